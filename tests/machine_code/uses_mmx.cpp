// SPDX-License-Identifier: BSD-3-Clause
// What no_mmx.sh has to find.
void use_mmx() { asm volatile("paddb %%mm1, %%mm0\n\temms" ::: "mm0", "memory"); }
