// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Several numbers at a time, of whatever width, by the vectors that GCC and Clang have in their language: a kernel's
/// body is written once, over a vector type, and compiled for every instruction set. Products are rounded (never half
/// of a fused multiply-add), so that every width gives the same bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

namespace orbis::optimize::detail::wide {

template <class S, std::size_t N>
struct vector_of {
  typedef S type
      __attribute__((vector_size(N * sizeof(S))));  // NOLINT(modernize-use-using): using refuses the attribute
};
/// `N` numbers of type `S`.
template <class S, std::size_t N>
using numbers = typename vector_of<S, N>::type;

template <class V, class S>
[[gnu::always_inline]] inline void load(V& v, const S* from) noexcept {
  std::memcpy(&v, from, sizeof v);
}
template <class V, class S>
[[gnu::always_inline]] inline void store(S* to, const V& v) noexcept {
  std::memcpy(to, &v, sizeof v);
}
/// The same number in all lanes.
template <class V, class S>
[[gnu::always_inline]] inline void fill(V& v, S value) noexcept {
  v = V{} + value;  // g++ 12 makes a single instruction of this, and of no other way to write it
}
/// `out = a * b`.
template <class V>
[[gnu::always_inline]] inline void multiply(V& out, const V& a, const V& b) noexcept {
#if defined(__clang__)
#pragma clang fp contract(off)
#endif
  out = a * b;
#if !defined(__clang__) && defined(__x86_64__)
  asm("" : "+v"(out));
#elif !defined(__clang__) && defined(__aarch64__)
  asm("" : "+w"(out));
#endif
}
/// `sum += a * b`.
template <class V>
[[gnu::always_inline]] inline void add_product(V& sum, const V& a, const V& b) noexcept {
  V product;
  multiply(product, a, b);
  sum += product;
}
/// `sum -= a * b`.
template <class V>
[[gnu::always_inline]] inline void subtract_product(V& sum, const V& a, const V& b) noexcept {
  V product;
  multiply(product, a, b);
  sum -= product;
}
/// `v` where `sign` is positive, and infinite or not a number where it is negative. (Of a comparison of 512 bits that
/// is inlined into a function for AVX-512 g++ 12 makes sixteen.)
template <class V>
[[gnu::always_inline]] inline void spoil_where_negative(V& v, const V& sign) noexcept {
  static_assert(sizeof(v[0]) == 4);
  numbers<std::int32_t, sizeof(V) / 4> bits, mask;
  std::memcpy(&mask, &sign, sizeof v);
  std::memcpy(&bits, &v, sizeof v);
  bits |= (mask >> 31) & 0x7f800000;
  std::memcpy(&v, &bits, sizeof v);
}
/// `f(std::integral_constant<std::size_t, i>)` for i from 0 to N - 1, written out.
template <std::size_t N, class F>
[[gnu::always_inline]] inline void unrolled(F&& f) {
  [&]<std::size_t... I>(std::index_sequence<I...>) __attribute__((always_inline)) {
    (f(std::integral_constant<std::size_t, I>{}), ...);
  }
  (std::make_index_sequence<N>{});
}

}  // namespace orbis::optimize::detail::wide
