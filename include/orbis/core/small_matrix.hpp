// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Arithmetic on fixed-size Eigen matrices that compiles fast: every operation returns a plain matrix, without Eigen's
/// expression templates, which take about ten times as long to compile.
///
/// Code in namespace orbis (and after `using namespace orbis`) finds these operators by ordinary lookup. They are
/// better matches in overload resolution than Eigen's members, so formulas look the same as with Eigen. A sum or
/// product is then a temporary matrix: do not store an Eigen expression that refers to it in an `auto` variable, as in
/// `auto t = (a - b).transpose()`. Other code keeps Eigen's operators. If an operand is an Eigen expression or of
/// dynamic size, Eigen's operator is used.
///
/// Sums of products run from the first entry to the last, as in Eigen for three-element vectors; in other cases the
/// last bits may differ from Eigen's results.
#pragma once

#include <cmath>
#include <concepts>
#include <type_traits>

#include <Eigen/Core>

namespace orbis {

/// An `R x C` matrix of `S` whose layout does not depend on `-m` compiler flags. Sizes that Eigen never aligns remain
/// the plain Eigen type, so `vec3` *is* `Eigen::Vector3d`.
template <int R, int C = 1, class S = double>
using matrix =
    Eigen::Matrix<S, R, C,
                  ((R == 1 && C != 1) ? Eigen::RowMajor : Eigen::ColMajor) |
                      ((static_cast<unsigned>(R * C) * sizeof(S)) % 16 == 0 ? Eigen::DontAlign : Eigen::AutoAlign)>;

namespace detail {

/// A scalar type that can multiply a matrix of `S` without a narrowing conversion, which Eigen rejects.
template <class T, class S>
concept factor_of = std::same_as<T, S> || std::integral<T>;

/// True if functions with this number of operations are inlined and their loops unrolled.
template <int Operations>
inline constexpr bool is_small = Operations <= 64;

/// `out[i] = f(a[i], b[i * Step])`. A `Step` of 0 broadcasts a scalar.
template <int N, int Step, class S, class F>
inline void entrywise(const S* a, const S* b, S* out, F f) {
  if constexpr (N <= 12) {
#pragma GCC unroll 12
    for (int i = 0; i < N; ++i) out[i] = f(a[i], b[Step * i]);
  } else {
    for (int i = 0; i < N; ++i) out[i] = f(a[i], b[Step * i]);
  }
}

/// The sum of `N` products; consecutive factors are `step_a` and `step_b` entries apart.
template <int N, class S>
[[nodiscard]] inline S sum_of_products(const S* a, int step_a, const S* b, int step_b) {
  S sum = a[0] * b[0];
#pragma GCC unroll 12
  for (int k = 1; k < N; ++k) sum += a[k * step_a] * b[k * step_b];
  return sum;
}

/// The product of an `R x K` and a `K x C` matrix, column by column. `a_row`, `a_column`, `b_row`, `b_column`:
/// distances between entries of neighbouring rows and columns.
template <int R, int K, int C, class S>
inline void multiply_inline(const S* a, int a_row, int a_column, const S* b, int b_row, int b_column, S* out) {
#pragma GCC unroll 12
  for (int c = 0; c < C; ++c)
#pragma GCC unroll 12
    for (int r = 0; r < R; ++r) out[c * R + r] = sum_of_products<K>(a + r * a_row, a_column, b + c * b_column, b_row);
}
/// Like `multiply_inline`, for larger matrices: not inlined, with rows in the inner loop.
template <int R, int K, int C, class S>
[[gnu::noinline]] void multiply(const S* a, int a_row, int a_column, const S* b, int b_row, int b_column, S* out) {
  for (int c = 0; c < C; ++c) {
    S* const to = out + c * R;
    for (int r = 0; r < R; ++r) to[r] = a[r * a_row] * b[c * b_column];
    for (int k = 1; k < K; ++k) {
      const S factor = b[k * b_row + c * b_column];
      for (int r = 0; r < R; ++r) to[r] += a[r * a_row + k * a_column] * factor;
    }
  }
}
template <int R, int K, int C, class S>
inline void multiply_any(const S* a, int a_row, int a_column, const S* b, int b_row, int b_column, S* out) {
  if constexpr (is_small<R * K * C>)
    multiply_inline<R, K, C>(a, a_row, a_column, b, b_row, b_column, out);
  else
    multiply<R, K, C>(a, a_row, a_column, b, b_row, b_column, out);
}

template <int R, int C, int O>
inline constexpr int row_step = (O & Eigen::RowMajor) != 0 ? C : 1;
template <int R, int C, int O>
inline constexpr int column_step = (O & Eigen::RowMajor) != 0 ? 1 : R;

}  // namespace detail

/// @name Sums, differences, and products with a scalar
/// @{
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) [[nodiscard]] inline Eigen::Matrix<S, R, C, O> operator+(
    const Eigen::Matrix<S, R, C, O, R, C>& a, const Eigen::Matrix<S, R, C, O, R, C>& b) {
  Eigen::Matrix<S, R, C, O> out;
  detail::entrywise<R * C, 1>(a.data(), b.data(), out.data(), [](S x, S y) { return x + y; });
  return out;
}
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) [[nodiscard]] inline Eigen::Matrix<S, R, C, O> operator-(
    const Eigen::Matrix<S, R, C, O, R, C>& a, const Eigen::Matrix<S, R, C, O, R, C>& b) {
  Eigen::Matrix<S, R, C, O> out;
  detail::entrywise<R * C, 1>(a.data(), b.data(), out.data(), [](S x, S y) { return x - y; });
  return out;
}
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) [[nodiscard]] inline Eigen::Matrix<S, R, C, O> operator-(
    const Eigen::Matrix<S, R, C, O, R, C>& a) {
  Eigen::Matrix<S, R, C, O> out;
  for (int i = 0; i < R * C; ++i) out.data()[i] = -a.data()[i];
  return out;
}
template <class S, int R, int C, int O, detail::factor_of<S> T>
requires(R > 0 && C > 0) [[nodiscard]] inline Eigen::Matrix<S, R, C, O> operator*(
    const Eigen::Matrix<S, R, C, O, R, C>& a, T t) {
  Eigen::Matrix<S, R, C, O> out;
  const S s = static_cast<S>(t);
  detail::entrywise<R * C, 0>(a.data(), &s, out.data(), [](S x, S y) { return x * y; });
  return out;
}
template <class S, int R, int C, int O, detail::factor_of<S> T>
requires(R > 0 && C > 0) [[nodiscard]] inline Eigen::Matrix<S, R, C, O> operator*(
    T t, const Eigen::Matrix<S, R, C, O, R, C>& a) {
  return a * t;
}
template <class S, int R, int C, int O, detail::factor_of<S> T>
requires(R > 0 && C > 0) [[nodiscard]] inline Eigen::Matrix<S, R, C, O> operator/(
    const Eigen::Matrix<S, R, C, O, R, C>& a, T t) {
  Eigen::Matrix<S, R, C, O> out;
  const S s = static_cast<S>(t);
  detail::entrywise<R * C, 0>(a.data(), &s, out.data(), [](S x, S y) { return x / y; });
  return out;
}
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) inline Eigen::Matrix<S, R, C, O>& operator+=(Eigen::Matrix<S, R, C, O, R, C>& a,
                                                                      const Eigen::Matrix<S, R, C, O, R, C>& b) {
  detail::entrywise<R * C, 1>(a.data(), b.data(), a.data(), [](S x, S y) { return x + y; });
  return a;
}
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) inline Eigen::Matrix<S, R, C, O>& operator-=(Eigen::Matrix<S, R, C, O, R, C>& a,
                                                                      const Eigen::Matrix<S, R, C, O, R, C>& b) {
  detail::entrywise<R * C, 1>(a.data(), b.data(), a.data(), [](S x, S y) { return x - y; });
  return a;
}
template <class S, int R, int C, int O, detail::factor_of<S> T>
requires(R > 0 && C > 0) inline Eigen::Matrix<S, R, C, O>& operator*=(Eigen::Matrix<S, R, C, O, R, C>& a, T t) {
  const S s = static_cast<S>(t);
  detail::entrywise<R * C, 0>(a.data(), &s, a.data(), [](S x, S y) { return x * y; });
  return a;
}
template <class S, int R, int C, int O, detail::factor_of<S> T>
requires(R > 0 && C > 0) inline Eigen::Matrix<S, R, C, O>& operator/=(Eigen::Matrix<S, R, C, O, R, C>& a, T t) {
  const S s = static_cast<S>(t);
  detail::entrywise<R * C, 0>(a.data(), &s, a.data(), [](S x, S y) { return x / y; });
  return a;
}
/// @}

/// @name Products of matrices
/// @{
template <class S, int R, int K, int C, int OA, int OB>
requires(R > 0 && K > 0 && C > 0) [[nodiscard]] inline matrix<R, C, S> operator*(
    const Eigen::Matrix<S, R, K, OA, R, K>& a, const Eigen::Matrix<S, K, C, OB, K, C>& b) {
  matrix<R, C, S> out;
  detail::multiply_any<R, K, C>(a.data(), detail::row_step<R, K, OA>, detail::column_step<R, K, OA>, b.data(),
                                detail::row_step<K, C, OB>, detail::column_step<K, C, OB>, out.data());
  return out;
}

/// The transposed matrix.
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) [[nodiscard]] inline matrix<C, R, S> transposed(const Eigen::Matrix<S, R, C, O, R, C>& a) {
  matrix<C, R, S> out;
  for (int r = 0; r < R; ++r)
    for (int c = 0; c < C; ++c)
      out.data()[C == 1 ? r : r * C + c] = a.data()[r * detail::row_step<R, C, O> + c * detail::column_step<R, C, O>];
  return out;
}

/// `transposed(a) * b`, without a copy.
template <class S, int K, int R, int C, int OA, int OB>
requires(R > 0 && K > 0 && C > 0)
    [[nodiscard]] inline matrix<R, C, S> transposed_product(const Eigen::Matrix<S, K, R, OA, K, R>& a,
                                                            const Eigen::Matrix<S, K, C, OB, K, C>& b) {
  matrix<R, C, S> out;
  detail::multiply_any<R, K, C>(a.data(), detail::column_step<K, R, OA>, detail::row_step<K, R, OA>, b.data(),
                                detail::row_step<K, C, OB>, detail::column_step<K, C, OB>, out.data());
  return out;
}

/// `a * transposed(b)` of two vectors.
template <class S, int R, int C, int OA, int OB>
requires(R > 0 && C > 0) [[nodiscard]] inline matrix<R, C, S> outer_product(const Eigen::Matrix<S, R, 1, OA, R, 1>& a,
                                                                            const Eigen::Matrix<S, C, 1, OB, C, 1>& b) {
  matrix<R, C, S> out;
  for (int c = 0; c < C; ++c)
    for (int r = 0; r < R; ++r) out.data()[R == 1 ? c : c * R + r] = a.data()[r] * b.data()[c];
  return out;
}
/// @}

/// @name Products of vectors, lengths
/// @{
template <class S, int R, int C, int OA, int OB>
requires(R > 0 && C > 0 && (R == 1 || C == 1)) [[nodiscard]] inline S
    dot(const Eigen::Matrix<S, R, C, OA, R, C>& a, const Eigen::Matrix<S, R, C, OB, R, C>& b) {
  return detail::sum_of_products<R * C>(a.data(), 1, b.data(), 1);
}

template <class S>
[[nodiscard]] inline matrix<3, 1, S> cross(const Eigen::Matrix<S, 3, 1>& a, const Eigen::Matrix<S, 3, 1>& b) {
  const S *p = a.data(), *q = b.data();
  return {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
}

/// The sum of the squares of all entries.
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) [[nodiscard]] inline S squared_norm(const Eigen::Matrix<S, R, C, O, R, C>& a) {
  return detail::sum_of_products<R * C>(a.data(), 1, a.data(), 1);
}

/// The square root of the sum of the squares of all entries.
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) [[nodiscard]] inline S norm(const Eigen::Matrix<S, R, C, O, R, C>& a) {
  return std::sqrt(squared_norm(a));
}

/// The vector scaled to length 1; a zero vector is returned unchanged.
template <class S, int R, int C, int O>
requires(R > 0 && C > 0)
    [[nodiscard]] inline Eigen::Matrix<S, R, C, O> normalized(const Eigen::Matrix<S, R, C, O, R, C>& a) {
  const S square = squared_norm(a);
  return square > S(0) ? a / std::sqrt(square) : a;
}
/// @}

/// @name Parts
/// @{
/// `N` entries of a vector, starting at `first`.
template <int N, class S, int R, int O>
requires(N > 0 && N <= R)
    [[nodiscard]] inline matrix<N, 1, S> segment(const Eigen::Matrix<S, R, 1, O, R, 1>& v, int first) {
  matrix<N, 1, S> out;
  for (int i = 0; i < N; ++i) out.data()[i] = v.data()[first + i];
  return out;
}
template <int N, class S>
[[nodiscard]] inline matrix<N, 1, S> segment(const Eigen::Matrix<S, Eigen::Dynamic, 1>& v, Eigen::Index first) {
  matrix<N, 1, S> out;
  for (int i = 0; i < N; ++i) out.data()[i] = v.data()[first + i];
  return out;
}
/// The first `N` entries of a vector.
template <int N, class S, int R, int O>
[[nodiscard]] inline matrix<N, 1, S> head(const Eigen::Matrix<S, R, 1, O, R, 1>& v) {
  return segment<N>(v, 0);
}
/// The last `N` entries of a vector.
template <int N, class S, int R, int O>
[[nodiscard]] inline matrix<N, 1, S> tail(const Eigen::Matrix<S, R, 1, O, R, 1>& v) {
  return segment<N>(v, R - N);
}

/// The entries of `a`, then those of `b`.
template <class S, int M, int N, int OA, int OB>
requires(M > 0 && N > 0) [[nodiscard]] inline matrix<M + N, 1, S> stacked(const Eigen::Matrix<S, M, 1, OA, M, 1>& a,
                                                                          const Eigen::Matrix<S, N, 1, OB, N, 1>& b) {
  matrix<M + N, 1, S> out;
  for (int i = 0; i < M; ++i) out.data()[i] = a.data()[i];
  for (int i = 0; i < N; ++i) out.data()[M + i] = b.data()[i];
  return out;
}

/// The `P x Q` block of a matrix, starting at (row, column).
template <int P, int Q, class S, int R, int C, int O>
requires(P > 0 && Q > 0 && P <= R && Q <= C)
    [[nodiscard]] inline matrix<P, Q, S> block(const Eigen::Matrix<S, R, C, O, R, C>& m, int row, int column) {
  matrix<P, Q, S> out;
  for (int c = 0; c < Q; ++c)
    for (int r = 0; r < P; ++r)
      out.data()[P == 1 ? c : c * P + r] =
          m.data()[(row + r) * detail::row_step<R, C, O> + (column + c) * detail::column_step<R, C, O>];
  return out;
}
/// Writes `part` into a matrix, starting at (row, column).
template <class S, int R, int C, int O, int P, int Q, int OP>
requires(P > 0 && Q > 0 && P <= R && Q <= C) inline void set_block(Eigen::Matrix<S, R, C, O, R, C>& m, int row,
                                                                   int column,
                                                                   const Eigen::Matrix<S, P, Q, OP, P, Q>& part) {
  for (int c = 0; c < Q; ++c)
    for (int r = 0; r < P; ++r)
      m.data()[(row + r) * detail::row_step<R, C, O> + (column + c) * detail::column_step<R, C, O>] =
          part.data()[r * detail::row_step<P, Q, OP> + c * detail::column_step<P, Q, OP>];
}
/// `a` with `b` to the right of it.
template <class S, int R, int C, int D, int OA, int OB>
[[nodiscard]] inline matrix<R, C + D, S> side_by_side(const Eigen::Matrix<S, R, C, OA, R, C>& a,
                                                      const Eigen::Matrix<S, R, D, OB, R, D>& b) {
  matrix<R, C + D, S> out;
  set_block(out, 0, 0, a);
  set_block(out, 0, C, b);
  return out;
}
/// Column `c` of a matrix.
template <class S, int R, int C, int O>
[[nodiscard]] inline matrix<R, 1, S> column_of(const Eigen::Matrix<S, R, C, O, R, C>& m, int c) {
  return block<R, 1>(m, 0, c);
}
/// Row `r` of a matrix, as a column vector.
template <class S, int R, int C, int O>
[[nodiscard]] inline matrix<C, 1, S> row_of(const Eigen::Matrix<S, R, C, O, R, C>& m, int r) {
  matrix<C, 1, S> out;
  for (int c = 0; c < C; ++c)
    out.data()[c] = m.data()[r * detail::row_step<R, C, O> + c * detail::column_step<R, C, O>];
  return out;
}
template <class S, int R, int C, int O>
inline void set_column(Eigen::Matrix<S, R, C, O, R, C>& m, int c, const matrix<R, 1, S>& v) {
  set_block(m, 0, c, v);
}
template <class S, int R, int C, int O>
inline void set_row(Eigen::Matrix<S, R, C, O, R, C>& m, int r, const matrix<C, 1, S>& v) {
  for (int c = 0; c < C; ++c) m.data()[r * detail::row_step<R, C, O> + c * detail::column_step<R, C, O>] = v.data()[c];
}
/// The matrix with columns `a`, `b` and `c`.
template <class S>
[[nodiscard]] inline matrix<3, 3, S> columns(const Eigen::Matrix<S, 3, 1>& a, const Eigen::Matrix<S, 3, 1>& b,
                                             const Eigen::Matrix<S, 3, 1>& c) {
  matrix<3, 3, S> out;
  for (int i = 0; i < 3; ++i) out(i, 0) = a[i], out(i, 1) = b[i], out(i, 2) = c[i];
  return out;
}
/// The matrix with rows `a`, `b` and `c`.
template <class S>
[[nodiscard]] inline matrix<3, 3, S> rows(const Eigen::Matrix<S, 3, 1>& a, const Eigen::Matrix<S, 3, 1>& b,
                                          const Eigen::Matrix<S, 3, 1>& c) {
  matrix<3, 3, S> out;
  for (int i = 0; i < 3; ++i) out(0, i) = a[i], out(1, i) = b[i], out(2, i) = c[i];
  return out;
}
/// The matrix with `v` on its diagonal.
template <class S, int R, int O>
requires(R > 0) [[nodiscard]] inline matrix<R, R, S> diagonal_matrix(const Eigen::Matrix<S, R, 1, O, R, 1>& v) {
  matrix<R, R, S> out;
  for (int c = 0; c < R; ++c)
    for (int r = 0; r < R; ++r) out.data()[c * R + r] = r == c ? v.data()[r] : S(0);
  return out;
}
/// Multiplies the entries on the diagonal of a square matrix by `factor` and adds `summand`.
template <class S, int R, int O>
requires(R > 0) inline void change_diagonal(Eigen::Matrix<S, R, R, O, R, R>& m, S factor, S summand) {
  for (int r = 0; r < R; ++r) m.data()[r * R + r] = m.data()[r * R + r] * factor + summand;
}
/// The entries on the diagonal of a square matrix.
template <class S, int R, int O>
requires(R > 0) [[nodiscard]] inline matrix<R, 1, S> diagonal(const Eigen::Matrix<S, R, R, O, R, R>& m) {
  matrix<R, 1, S> out;
  for (int r = 0; r < R; ++r) out.data()[r] = m.data()[r * R + r];
  return out;
}
/// @}

/// @name Constant matrices
/// @{
/// A matrix of type `M` with all entries equal to `value`.
template <class M>
[[nodiscard]] inline M filled(typename M::Scalar value) {
  M out;
  for (int i = 0; i < M::SizeAtCompileTime; ++i) out.data()[i] = value;
  return out;
}
/// A matrix of type `M` with all entries 0.
template <class M>
[[nodiscard]] inline M zeros() {
  return filled<M>(typename M::Scalar(0));
}
/// A matrix of type `M` with 1 on its diagonal and 0 elsewhere.
template <class M>
[[nodiscard]] inline M identity() {
  M out = zeros<M>();
  for (int i = 0; i < M::RowsAtCompileTime && i < M::ColsAtCompileTime; ++i) out(i, i) = typename M::Scalar(1);
  return out;
}
/// @}

/// @name Entries
/// @{
/// True if no entry is infinite or NaN.
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) [[nodiscard]] inline bool all_finite(const Eigen::Matrix<S, R, C, O, R, C>& a) {
  bool finite = true;
  for (int i = 0; i < R * C; ++i) finite = finite && std::isfinite(a.data()[i]);
  return finite;
}
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) [[nodiscard]] inline S sum_entries(const Eigen::Matrix<S, R, C, O, R, C>& a) {
  S sum = a.data()[0];
  for (int i = 1; i < R * C; ++i) sum += a.data()[i];
  return sum;
}
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) [[nodiscard]] inline S min_entry(const Eigen::Matrix<S, R, C, O, R, C>& a) {
  S least = a.data()[0];
  for (int i = 1; i < R * C; ++i)
    if (a.data()[i] < least) least = a.data()[i];
  return least;
}
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) [[nodiscard]] inline S max_entry(const Eigen::Matrix<S, R, C, O, R, C>& a) {
  S most = a.data()[0];
  for (int i = 1; i < R * C; ++i)
    if (a.data()[i] > most) most = a.data()[i];
  return most;
}
/// True if each entry of `a` is at most the corresponding entry of `b`.
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) [[nodiscard]] inline bool all_at_most(const Eigen::Matrix<S, R, C, O, R, C>& a,
                                                               const Eigen::Matrix<S, R, C, O, R, C>& b) {
  for (int i = 0; i < R * C; ++i)
    if (!(a.data()[i] <= b.data()[i])) return false;
  return true;
}
/// True if any entry of `a` is greater than the corresponding entry of `b`.
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) [[nodiscard]] inline bool any_greater(const Eigen::Matrix<S, R, C, O, R, C>& a,
                                                               const Eigen::Matrix<S, R, C, O, R, C>& b) {
  for (int i = 0; i < R * C; ++i)
    if (a.data()[i] > b.data()[i]) return true;
  return false;
}
/// The matrix with `summand` added to each entry.
template <class S, int R, int C, int O>
requires(R > 0 && C > 0)
    [[nodiscard]] inline Eigen::Matrix<S, R, C, O> shifted(const Eigen::Matrix<S, R, C, O, R, C>& a,
                                                           std::type_identity_t<S> summand) {
  Eigen::Matrix<S, R, C, O> out;
  for (int i = 0; i < R * C; ++i) out.data()[i] = a.data()[i] + summand;
  return out;
}
/// The absolute values of the entries.
template <class S, int R, int C, int O>
requires(R > 0 && C > 0)
    [[nodiscard]] inline Eigen::Matrix<S, R, C, O> magnitudes(const Eigen::Matrix<S, R, C, O, R, C>& a) {
  Eigen::Matrix<S, R, C, O> out;
  for (int i = 0; i < R * C; ++i) out.data()[i] = std::abs(a.data()[i]);
  return out;
}
/// The homogeneous coordinates `(x, y, 1)` of a point `(x, y)`.
template <class S, int O>
[[nodiscard]] inline matrix<3, 1, S> homogeneous(const Eigen::Matrix<S, 2, 1, O, 2, 1>& p) {
  return {p.data()[0], p.data()[1], S(1)};
}
/// The largest absolute value of an entry; NaN if an entry is NaN.
template <class S, int R, int C, int O>
requires(R > 0 && C > 0) [[nodiscard]] inline S largest_magnitude(const Eigen::Matrix<S, R, C, O, R, C>& a) {
  S most = std::abs(a.data()[0]);
  for (int i = 1; i < R * C; ++i) {
    const S size = std::abs(a.data()[i]);
    if (size > most || size != size) most = size;
  }
  return most;
}
/// Element-wise product.
template <class S, int R, int C, int O>
requires(R > 0 && C > 0)
    [[nodiscard]] inline Eigen::Matrix<S, R, C, O> entrywise_product(const Eigen::Matrix<S, R, C, O, R, C>& a,
                                                                     const Eigen::Matrix<S, R, C, O, R, C>& b) {
  Eigen::Matrix<S, R, C, O> out;
  detail::entrywise<R * C, 1>(a.data(), b.data(), out.data(), [](S x, S y) { return x * y; });
  return out;
}
/// Element-wise minimum.
template <class S, int R, int C, int O>
requires(R > 0 && C > 0)
    [[nodiscard]] inline Eigen::Matrix<S, R, C, O> entrywise_min(const Eigen::Matrix<S, R, C, O, R, C>& a,
                                                                 const Eigen::Matrix<S, R, C, O, R, C>& b) {
  Eigen::Matrix<S, R, C, O> out;
  detail::entrywise<R * C, 1>(a.data(), b.data(), out.data(), [](S x, S y) { return y < x ? y : x; });
  return out;
}
/// Element-wise maximum.
template <class S, int R, int C, int O>
requires(R > 0 && C > 0)
    [[nodiscard]] inline Eigen::Matrix<S, R, C, O> entrywise_max(const Eigen::Matrix<S, R, C, O, R, C>& a,
                                                                 const Eigen::Matrix<S, R, C, O, R, C>& b) {
  Eigen::Matrix<S, R, C, O> out;
  detail::entrywise<R * C, 1>(a.data(), b.data(), out.data(), [](S x, S y) { return x < y ? y : x; });
  return out;
}
/// Casts the entries to another scalar type.
template <class T, class S, int R, int C, int O>
requires(R > 0 && C > 0) [[nodiscard]] inline matrix<R, C, T> converted(const Eigen::Matrix<S, R, C, O, R, C>& a) {
  matrix<R, C, T> out;
  for (int c = 0; c < C; ++c)
    for (int r = 0; r < R; ++r) out(r, c) = static_cast<T>(a(r, c));
  return out;
}
/// @}

/// @name Eigen expressions and matrices of dynamic size, which Eigen evaluates
/// @{
template <class D>
[[nodiscard]] inline auto transposed(const Eigen::MatrixBase<D>& a) {
  return a.transpose().eval();
}
template <class A, class B>
[[nodiscard]] inline auto dot(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  return a.dot(b);
}
template <class D>
[[nodiscard]] inline auto squared_norm(const Eigen::MatrixBase<D>& a) {
  return a.squaredNorm();
}
template <class D>
[[nodiscard]] inline auto norm(const Eigen::MatrixBase<D>& a) {
  return a.norm();
}
template <class D>
[[nodiscard]] inline bool all_finite(const Eigen::MatrixBase<D>& a) {
  return a.allFinite();
}
/// @}

/// @name Square matrices
/// @{
template <class S, int N, int O>
requires(N > 0) [[nodiscard]] inline S trace(const Eigen::Matrix<S, N, N, O, N, N>& m) {
  S sum = m.data()[0];
  for (int i = 1; i < N; ++i) sum += m.data()[i * N + i];
  return sum;
}
template <class S, int O>
[[nodiscard]] inline S determinant(const Eigen::Matrix<S, 2, 2, O, 2, 2>& m) {
  return m(0, 0) * m(1, 1) - m(1, 0) * m(0, 1);
}
template <class S, int O>
[[nodiscard]] inline S determinant(const Eigen::Matrix<S, 3, 3, O, 3, 3>& m) {
  return m(0, 0) * (m(1, 1) * m(2, 2) - m(1, 2) * m(2, 1)) - m(0, 1) * (m(1, 0) * m(2, 2) - m(1, 2) * m(2, 0)) +
         m(0, 2) * (m(1, 0) * m(2, 1) - m(1, 1) * m(2, 0));
}
/// The inverse by cofactors. Entries are not finite if the matrix is singular.
template <class S, int O>
[[nodiscard]] inline Eigen::Matrix<S, 2, 2, O> inverse(const Eigen::Matrix<S, 2, 2, O, 2, 2>& m) {
  const S scale = S(1) / determinant(m);
  Eigen::Matrix<S, 2, 2, O> out;
  out(0, 0) = m(1, 1) * scale, out(1, 0) = -m(1, 0) * scale;
  out(0, 1) = -m(0, 1) * scale, out(1, 1) = m(0, 0) * scale;
  return out;
}
template <class S, int O>
[[nodiscard]] inline Eigen::Matrix<S, 3, 3, O> inverse(const Eigen::Matrix<S, 3, 3, O, 3, 3>& m) {
  Eigen::Matrix<S, 3, 3, O> out;  // the adjugate first
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      const int p = (i + 1) % 3, q = (i + 2) % 3, s = (k + 1) % 3, t = (k + 2) % 3;
      out(k, i) = m(p, s) * m(q, t) - m(p, t) * m(q, s);
    }
  const S scale = S(1) / (out(0, 0) * m(0, 0) + (out(0, 1) * m(1, 0) + out(0, 2) * m(2, 0)));
  return out * scale;
}
/// The inverse by elimination with row pivoting. Entries are not finite if the matrix is singular.
template <class S, int N, int O>
requires(N > 3) [[nodiscard]] inline Eigen::Matrix<S, N, N, O> inverse(Eigen::Matrix<S, N, N, O, N, N> m) {
  Eigen::Matrix<S, N, N, O> out = identity<Eigen::Matrix<S, N, N, O>>();
  for (int c = 0; c < N; ++c) {
    int pivot = c;
    for (int r = c + 1; r < N; ++r)
      if (std::abs(m(r, c)) > std::abs(m(pivot, c))) pivot = r;
    const S scale = S(1) / m(pivot, c);
    for (int k = 0; k < N; ++k) {
      const S a = m(pivot, k), b = out(pivot, k);
      m(pivot, k) = m(c, k), out(pivot, k) = out(c, k);
      m(c, k) = a * scale, out(c, k) = b * scale;
    }
    for (int r = 0; r < N; ++r) {
      if (r == c) continue;
      const S factor = m(r, c);
      for (int k = 0; k < N; ++k) {
        m(r, k) -= factor * m(c, k);
        out(r, k) -= factor * out(c, k);
      }
    }
  }
  return out;
}
/// @}

}  // namespace orbis
