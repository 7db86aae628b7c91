// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <orbis/core/image.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("image views are values that convert from mutable to const only") {
  static_assert(std::is_copy_constructible_v<image_view<int>> && std::is_copy_assignable_v<image_view<int>>);
  static_assert(std::is_copy_constructible_v<image_view<const int>>);
  static_assert(std::is_trivially_copyable_v<image_view<int>> && std::is_trivially_copyable_v<image_view<const int>>);
  static_assert(std::is_convertible_v<image_view<int>, image_view<const int>>);
  static_assert(!std::is_convertible_v<image_view<const int>, image_view<int>>);
  static_assert(!std::is_convertible_v<image_view<int>, image_view<const long>>);
  static_assert(std::is_convertible_v<image<int>&, image_view<int>>);
  static_assert(std::is_convertible_v<const image<int>&, image_view<const int>>);
  static_assert(!std::is_convertible_v<const image<int>&, image_view<int>>);
}

TEST_CASE("a view with a stride shows the inside of a larger image") {
  std::array<int, 20> pixels{};
  for (int i = 0; i != 20; ++i) pixels[static_cast<std::size_t>(i)] = i;
  const image_view<int> inside{pixels.data() + 6, 3, 2, 5};
  CHECK(inside(0, 0) == 6);
  CHECK(inside(2, 1) == 13);
  CHECK(inside.row(1).size() == 3);
  CHECK(inside.row(1)[0] == 11);
  inside(1, 1) = -1;
  CHECK(pixels[12] == -1);
  const image_view<const int> constant = inside;
  CHECK(constant.stride() == 5);
  CHECK(constant(1, 1) == -1);
  CHECK(constant.data() == inside.data());
}

TEST_CASE("a view contains its pixels and no others") {
  const image<int> i{4, 3};
  const auto v = i.view();
  CHECK(v.contains(0, 0));
  CHECK(v.contains(3, 2));
  CHECK(!v.contains(4, 2));
  CHECK(!v.contains(3, 3));
  CHECK(!v.contains(-1, 0));
  CHECK(!v.contains(0, -1));
  CHECK(!v.empty());
  CHECK(image_view<int>{}.empty());
  CHECK(image<int>{0, 5}.view().empty());
}

TEST_CASE("an image owns its pixels row by row") {
  image<rgb8> a{4, 3, {1, 2, 3}};
  CHECK(a.pixels().size() == 12);
  CHECK(a(3, 2) == rgb8{1, 2, 3});
  a(1, 2) = {9, 8, 7};
  CHECK(a.data()[2 * 4 + 1] == rgb8{9, 8, 7});
  CHECK(a.row(2)[1].r == 9);
  image<rgb8> b = a;
  CHECK(b == a);
  b(0, 0).g = 77;
  CHECK(!(b == a));
  const image<rgb8>& c = a;
  CHECK(c.view()(1, 2).b == 7);
  CHECK(image<int>{}.empty());
  CHECK(!(image<int>{2, 3} == image<int>{3, 2}));
}

TEST_CASE("a copy of a view has its pixels and size, in memory that is used again where it fits") {
  std::array<int, 20> pixels{};
  for (int i = 0; i != 20; ++i) pixels[static_cast<std::size_t>(i)] = i;
  const image_view<int> inside{pixels.data() + 6, 3, 2, 5};
  image<int> copy;
  copy_pixels(inside, copy);
  REQUIRE(copy.width() == 3);
  REQUIRE(copy.height() == 2);
  CHECK(std::ranges::equal(copy.pixels(), std::array{6, 7, 8, 11, 12, 13}));
  const int* const memory = copy.data();
  pixels[7] = -1;
  CHECK(copy(1, 0) == 7);
  copy_pixels(inside, copy);
  CHECK(copy(1, 0) == -1);
  CHECK(copy.data() == memory);
  const image<int> wide{6, 1, 9};  // as many pixels, but another size
  copy_pixels(wide, copy);
  CHECK(copy == wide);
  CHECK(image<int>{inside} == image<int>{image<int>{inside}.view()});
  CHECK(std::ranges::equal(image<int>{inside}.pixels(), std::array{6, -1, 8, 11, 12, 13}));
  copy_pixels({}, copy);
  CHECK(copy.width() == 0);
  CHECK(copy.empty());
}
