// SPDX-License-Identifier: BSD-3-Clause
//
// A plugin for qemu-aarch64 (TCG plugin API, version 1) that counts the work of a single-threaded program on a Cortex-A72
// as in a Raspberry Pi 4: instructions by kind, mispredicted branches, and misses of the data caches. With qemu-x86_64,
// only the numbers of instructions and accesses are meaningful.
//
//   qemu-aarch64 -plugin libcount.so,out=counts.tsv program
//
// A program sets marks by system call 0x6f72 with a label of up to 8 characters as argument (see marks.hpp); reading the
// clock also sets a mark, with the label "clock". At each mark the plugin writes a line with the label and all counts so
// far, as in `heading` below: the work between two marks is the difference of their lines.
//
// Simulation: data cache of 32 kB, 2 ways; L2 cache of 1 MB, 16 ways; lines of 64 bytes, LRU replacement, write-allocate.
// The L2 cache is not shared and contains no instructions. There is no prefetching; instead, a miss next to one of the
// last 16 misses is also counted as `ahead`, because the A72 prefetches along such streams. Branches: two tables of
// two-bit counters, by address and by address and history, with a third one that selects; indirect jumps and returns
// count as predicted.
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// --- the used part of the plugin API, from QEMU's documentation ----------------------------------

typedef uint64_t plugin_id;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
enum { no_registers = 0, reads_and_writes = 3 };

void qemu_plugin_register_vcpu_tb_trans_cb(plugin_id, void (*)(plugin_id, struct qemu_plugin_tb*));
void qemu_plugin_register_vcpu_tb_exec_cb(struct qemu_plugin_tb*, void (*)(unsigned, void*), int, void*);
void qemu_plugin_register_vcpu_mem_cb(struct qemu_plugin_insn*, void (*)(unsigned, uint32_t, uint64_t, void*), int, int,
                                      void*);
void qemu_plugin_register_vcpu_syscall_cb(plugin_id,
                                          void (*)(plugin_id, unsigned, int64_t, uint64_t, uint64_t, uint64_t, uint64_t,
                                                   uint64_t, uint64_t, uint64_t, uint64_t));
void qemu_plugin_register_atexit_cb(plugin_id, void (*)(plugin_id, void*), void*);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb*);
uint64_t qemu_plugin_tb_vaddr(const struct qemu_plugin_tb*);
struct qemu_plugin_insn* qemu_plugin_tb_get_insn(const struct qemu_plugin_tb*, size_t);
const void* qemu_plugin_insn_data(const struct qemu_plugin_insn*);
unsigned qemu_plugin_mem_size_shift(uint32_t);

#define EXPORTED __attribute__((visibility("default")))
EXPORTED int qemu_plugin_version = 1;

// --- counts --------------------------------------------------------------------------------------

enum count { instructions, memory, branches, vector, wide, slow, mispredicted, l1, l2_hit_ahead, l2, l2_ahead, kinds };
static const char heading[] =
    "label\tinstructions\tmemory\tbranches\tvector\twide\tslow\tmispredicted\tl1\tl2_hit_ahead\tl2\tl2_ahead\n";
static uint64_t counts[kinds];
static FILE* out;
static int64_t clock_gettime_number = 113;  // of Linux on aarch64

static void write_line(const char* label) {
  fputs(label, out);
  for (int i = 0; i != kinds; ++i) fprintf(out, "\t%llu", (unsigned long long)counts[i]);
  fputc('\n', out);
}

// --- data caches ---------------------------------------------------------------------------------

enum { line_bits = 6, l1_sets = 256, l1_ways = 2, l2_sets = 1024, l2_ways = 16, streams = 16 };
static uint64_t l1_lines[l1_sets][l1_ways], l2_lines[l2_sets][l2_ways];  // most recently used first; 0: empty

/// Returns true if the line is cached; loads it otherwise.
static bool touch(uint64_t* ways, int count, uint64_t line) {
  int i = 0;
  while (i != count - 1 && ways[i] != line) ++i;
  const bool found = ways[i] == line;
  for (; i != 0; --i) ways[i] = ways[i - 1];
  ways[0] = line;
  return found;
}

/// Returns true if this miss is next to a recent one.
static bool is_ahead(uint64_t* recent, unsigned* oldest, uint64_t line) {
  for (int i = 0; i != streams; ++i)
    if (recent[i] + 1 == line || recent[i] - 1 == line) {
      recent[i] = line;
      return true;
    }
  recent[*oldest] = line;
  *oldest = (*oldest + 1) % streams;
  return false;
}

static void access_line(uint64_t line) {
  static uint64_t recent[2][streams];
  static unsigned oldest[2];
  if (l1_lines[line % l1_sets][0] == line || touch(l1_lines[line % l1_sets], l1_ways, line)) return;
  ++counts[l1];
  const bool ahead = is_ahead(recent[0], &oldest[0], line);
  if (touch(l2_lines[line % l2_sets], l2_ways, line)) {
    counts[l2_hit_ahead] += ahead;
    return;
  }
  ++counts[l2];
  counts[l2_ahead] += is_ahead(recent[1], &oldest[1], line);
}

static void on_memory(unsigned vcpu, uint32_t info, uint64_t address, void* data) {
  (void)vcpu, (void)data;
  const uint64_t first = (address >> line_bits) + 1;  // 0 means empty
  const uint64_t last = ((address + (1u << qemu_plugin_mem_size_shift(info)) - 1) >> line_bits) + 1;
  access_line(first);
  if (last != first) access_line(last);
}

// --- branches ------------------------------------------------------------------------------------

enum { table_bits = 13, history_bits = 12 };

static void note_branch(uint64_t address, bool taken) {
  static uint8_t by_address[1 << table_bits], by_history[1 << table_bits], chooser[1 << table_bits];
  static uint64_t history;
  const uint64_t mask = (1u << table_bits) - 1, word = address >> 2;
  uint8_t* const a = &by_address[word & mask];
  uint8_t* const h = &by_history[(word ^ history) & mask];
  uint8_t* const c = &chooser[word & mask];
  const bool a_right = (*a >= 2) == taken, h_right = (*h >= 2) == taken;
  counts[mispredicted] += !(*c >= 2 ? h_right : a_right);
  if (a_right != h_right) *c = h_right ? (*c < 3 ? *c + 1 : 3) : (*c > 0 ? *c - 1 : 0);
  *a = taken ? (*a < 3 ? *a + 1 : 3) : (*a > 0 ? *a - 1 : 0);
  *h = taken ? (*h < 3 ? *h + 1 : 3) : (*h > 0 ? *h - 1 : 0);
  history = ((history << 1) | taken) & ((1u << history_bits) - 1);
}

// --- blocks of instructions ----------------------------------------------------------------------

struct block {
  uint64_t begin, end;
  bool ends_in_condition;
  uint32_t counts[slow + 1];
};

static void on_block(unsigned vcpu, void* data) {
  static const struct block* last;
  (void)vcpu;
  const struct block* const b = data;
  if (last != NULL && last->ends_in_condition) note_branch(last->end - 4, b->begin != last->end);
  last = b;
  for (int i = 0; i <= slow; ++i) counts[i] += b->counts[i];
}

/// By the main groups of the A64 encoding (bits 28 to 25).
static void classify(uint32_t word, struct block* b) {
  const unsigned group = (word >> 25) & 0xf;
  ++b->counts[instructions];
  b->ends_in_condition = (word & 0xff000010u) == 0x54000000u || (word & 0x7c000000u) == 0x34000000u;
  if ((group & 0xe) == 0xa) {
    ++b->counts[branches];
  } else if ((group & 0x5) == 0x4) {
    ++b->counts[memory];
  } else if ((group & 0x7) == 0x7) {
    ++b->counts[vector];
    const bool is_wide = (word & 0x50000000u) == 0x40000000u;  // 128 bits, not a scalar
    b->counts[wide] += is_wide;
    const bool divides = (word & 0xff20fc00u) == 0x1e201800u || (word & 0xbfa0fc00u) == 0x2e20fc00u;
    const bool takes_root = (word & 0xff3ffc00u) == 0x1e21c000u || (word & 0xbfbffc00u) == 0x2ea1f800u;
    if (divides || takes_root) b->counts[slow] += is_wide ? 2 : 1;
  } else if ((word & 0x7fe0f800u) == 0x1ac00800u) {
    ++b->counts[slow];  // integers
  }
}

static void on_translation(plugin_id id, struct qemu_plugin_tb* tb) {
  (void)id;
  struct block* const b = calloc(1, sizeof *b);  // blocks may be translated again; all are kept until the end
  const size_t n = qemu_plugin_tb_n_insns(tb);
  b->begin = qemu_plugin_tb_vaddr(tb);
  b->end = b->begin + 4 * n;
  for (size_t i = 0; i != n; ++i) {
    struct qemu_plugin_insn* const insn = qemu_plugin_tb_get_insn(tb, i);
    uint32_t word;
    memcpy(&word, qemu_plugin_insn_data(insn), sizeof word);
    classify(word, b);
    qemu_plugin_register_vcpu_mem_cb(insn, on_memory, no_registers, reads_and_writes, NULL);
  }
  qemu_plugin_register_vcpu_tb_exec_cb(tb, on_block, no_registers, b);
}

// --- marks ---------------------------------------------------------------------------------------

static void on_syscall(plugin_id id, unsigned vcpu, int64_t number, uint64_t a1, uint64_t a2, uint64_t a3, uint64_t a4,
                       uint64_t a5, uint64_t a6, uint64_t a7, uint64_t a8) {
  (void)id, (void)vcpu, (void)a2, (void)a3, (void)a4, (void)a5, (void)a6, (void)a7, (void)a8;
  enum { mark_number = 0x6f72 };
  if (number == clock_gettime_number) write_line("clock");
  if (number == mark_number) {
    char label[9] = {0};
    memcpy(label, &a1, 8);
    write_line(label);
  }
}

static void on_end(plugin_id id, void* data) {
  (void)id, (void)data;
  write_line("exit");
  fclose(out);
}

EXPORTED int qemu_plugin_install(plugin_id id, const void* info, int argc, char** argv) {
  const char* target = *(const char* const*)info;  // the first member
  if (strcmp(target, "x86_64") == 0) clock_gettime_number = 228;
  for (int i = 0; i != argc; ++i)
    if (strncmp(argv[i], "out=", 4) == 0) out = fopen(argv[i] + 4, "w");
  if (out == NULL) {
    fputs("count: wants out=FILE, a file that can be written\n", stderr);
    return 1;
  }
  fputs(heading, out);
  qemu_plugin_register_vcpu_tb_trans_cb(id, on_translation);
  qemu_plugin_register_vcpu_syscall_cb(id, on_syscall);
  qemu_plugin_register_atexit_cb(id, on_end, NULL);
  return 0;
}
