// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What `hamming_slices.hpp` does with a register of bit planes, for each instruction set.
#pragma once

#include <cstddef>
#include <cstdint>

#include <orbis/core/bits.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/features/hamming.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::features::detail {

// What the search is compiled for: a plane is a register, and all functions take theirs by reference, so that none
// of them is called with a register that the baseline does not have.

/// Registers every 64-bit machine has: SSE2, NEON, or the vectors of another machine.
struct slice_ops_portable {
  static constexpr std::size_t words = 4;  ///< of a slice
#if defined(__GNUC__)
  using plane = std::uint64_t __attribute__((vector_size(16), may_alias));
#else
  using plane = std::uint64_t;
#endif
  static void load(plane& x, const char* from) noexcept { x = *reinterpret_cast<const plane*>(from); }
  static void store(char* to, const plane& x) noexcept { *reinterpret_cast<plane*>(to) = x; }
  /// sum, carry = sum + a + b
  static void add(plane& sum, plane& carry, const plane& a, const plane& b) noexcept {
    const plane either = a ^ b;
    carry = (a & b) | (either & sum);
    sum ^= either;
  }
  /// sum, a = sum + a
  static void add(plane& sum, plane& a) noexcept {
    const plane carry = sum & a;
    sum ^= a;
    a = carry;
  }
  /// below = whether x < y, given the same of the lower bits
  static void compare(plane& below, const plane& x, const plane& y) noexcept { below = (~x & y) | (~(x ^ y) & below); }
  /// to = where ? from : to
  static void replace(plane& to, const plane& from, const plane& where) noexcept { to ^= (to ^ from) & where; }
  static std::uint32_t ones(std::uint64_t x) noexcept { return count_ones(x); }
};

#if ORBIS_X86
struct slice_ops_popcnt : slice_ops_portable {
  ORBIS_TARGET("popcnt") static std::uint32_t ones(std::uint64_t x) noexcept {
    return static_cast<std::uint32_t>(__builtin_popcountll(x));
  }
};

struct slice_ops_avx2 : slice_ops_popcnt {
  using plane = __m256i;
  ORBIS_TARGET("avx2") static void load(plane& x, const char* from) noexcept {
    x = _mm256_load_si256(reinterpret_cast<const __m256i*>(from));
  }
  ORBIS_TARGET("avx2") static void store(char* to, const plane& x) noexcept {
    _mm256_store_si256(reinterpret_cast<__m256i*>(to), x);
  }
  ORBIS_TARGET("avx2")
  static void add(plane& sum, plane& carry, const plane& a, const plane& b) noexcept {
    const __m256i either = _mm256_xor_si256(a, b);
    carry = _mm256_or_si256(_mm256_and_si256(a, b), _mm256_and_si256(either, sum));
    sum = _mm256_xor_si256(sum, either);
  }
  ORBIS_TARGET("avx2") static void add(plane& sum, plane& a) noexcept {
    const __m256i carry = _mm256_and_si256(sum, a);
    sum = _mm256_xor_si256(sum, a);
    a = carry;
  }
  ORBIS_TARGET("avx2")
  static void compare(plane& below, const plane& x, const plane& y) noexcept {
    below = _mm256_or_si256(_mm256_andnot_si256(x, y), _mm256_andnot_si256(_mm256_xor_si256(x, y), below));
  }
  ORBIS_TARGET("avx2")
  static void replace(plane& to, const plane& from, const plane& where) noexcept {
    to = _mm256_or_si256(_mm256_and_si256(where, from), _mm256_andnot_si256(where, to));
  }
};

/// The ternary logic makes a full adder of two instructions.
struct slice_ops_avx512 : slice_ops_popcnt {
  using plane = __m512i;
  static constexpr std::size_t words = 8;
  ORBIS_TARGET("avx512f")
  static void load(plane& x, const char* from) noexcept { x = _mm512_load_si512(from); }
  ORBIS_TARGET("avx512f") static void store(char* to, const plane& x) noexcept { _mm512_store_si512(to, x); }
  ORBIS_TARGET("avx512f")
  static void add(plane& sum, plane& carry, const plane& a, const plane& b) noexcept {
    carry = _mm512_ternarylogic_epi64(sum, a, b, 0xe8);
    sum = _mm512_ternarylogic_epi64(sum, a, b, 0x96);
  }
  ORBIS_TARGET("avx512f") static void add(plane& sum, plane& a) noexcept {
    const __m512i carry = _mm512_and_si512(sum, a);
    sum = _mm512_xor_si512(sum, a);
    a = carry;
  }
  ORBIS_TARGET("avx512f")
  static void compare(plane& below, const plane& x, const plane& y) noexcept {
    below = _mm512_ternarylogic_epi64(below, x, y, 0xb2);
  }
  ORBIS_TARGET("avx512f")
  static void replace(plane& to, const plane& from, const plane& where) noexcept {
    to = _mm512_ternarylogic_epi64(to, from, where, 0xd8);
  }
};
#endif

}  // namespace orbis::features::detail
