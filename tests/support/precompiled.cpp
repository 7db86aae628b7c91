// SPDX-License-Identifier: BSD-3-Clause
//
// Only there to have the precompiled header made.
