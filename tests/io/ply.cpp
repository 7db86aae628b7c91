// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <orbis/core/file.hpp>
#include <orbis/core/point.hpp>
#include <orbis/io/ply.hpp>

#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

namespace io = orbis::io;
using orbis::rgb8;
using orbis::vec3f;

namespace {

orbis::point_cloud some_cloud(bool colored) {
  orbis::point_cloud cloud;
  for (int i = 0; i != 100; ++i) {
    const auto f = static_cast<float>(i);
    cloud.points.emplace_back(f / 3.0F, -1e-7F * f, 1e6F / (f + 1.0F));
    if (colored)
      cloud.colors.push_back(
          {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(255 - i), static_cast<std::uint8_t>(7 * i)});
  }
  return cloud;
}

template <class T>
void append(std::string& to, T value, std::endian order) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  if (order != std::endian::native) std::reverse(bytes, bytes + sizeof(T));
  to.append(bytes, sizeof(T));
}

}  // namespace

TEST_CASE("clouds survive writing and reading a PLY exactly") {
  const orbis::test::temporary_folder folder;
  for (const auto encoding : {io::ply_encoding::ascii, io::ply_encoding::binary})
    for (const bool colored : {false, true}) {
      const auto cloud = some_cloud(colored);
      REQUIRE(io::write_ply(folder / "c.ply", cloud, {.encoding = encoding}));
      const auto read = io::read_ply(folder / "c.ply").value();
      CHECK(read.points == cloud.points);
      CHECK(read.colors == cloud.colors);
    }
}

TEST_CASE("a cloud far from its origin is written where it was, to a tenth of a millimetre") {
  const orbis::test::temporary_folder folder;
  const orbis::vec3 origin{455'000.0, 5'430'000.0, -3.0};
  for (const auto encoding : {io::ply_encoding::ascii, io::ply_encoding::binary})
    for (const bool colored : {false, true}) {
      const auto cloud = some_cloud(colored);
      REQUIRE(io::write_ply(folder / "far.ply", cloud, {.encoding = encoding, .origin = origin}));
      const auto text = orbis::read_file(folder / "far.ply").value();
      CHECK(text.find("property double z\n") != text.npos);
      const auto read = io::parse_ply(text, {}, origin).value();
      CHECK(read.colors == cloud.colors);
      REQUIRE(read.points.size() == cloud.points.size());
      double worst = 0.0;
      for (std::size_t i = 0; i != read.points.size(); ++i)
        if (orbis::is_finite(cloud.points[i]))
          worst = std::max(worst, double{(read.points[i] - cloud.points[i]).cwiseAbs().maxCoeff()} /
                                      (1.0 + double{cloud.points[i].norm()}));
      CHECK(worst < 1e-4);
      CHECK(io::read_ply(folder / "far.ply").value().points[0].y() > 5e6F - 1e3F);
    }
}

TEST_CASE("chosen points of a cloud are written as a cloud of them would be") {
  const orbis::test::temporary_folder folder;
  for (const auto encoding : {io::ply_encoding::ascii, io::ply_encoding::binary})
    for (const bool colored : {false, true}) {
      orbis::point_cloud cloud, chosen;
      while (cloud.size() < 20'000) {  // more than a block
        const auto more = some_cloud(colored);
        cloud.points.insert(cloud.points.end(), more.points.begin(), more.points.end());
        cloud.colors.insert(cloud.colors.end(), more.colors.begin(), more.colors.end());
      }
      std::vector<std::uint32_t> indices;
      for (std::uint32_t i = 1; i < cloud.size(); i += 1 + i % 3) {
        indices.push_back(i);
        chosen.points.push_back(cloud.points[i]);
        if (colored) chosen.colors.push_back(cloud.colors[i]);
      }
      REQUIRE(io::write_ply(folder / "some.ply", cloud, indices, {.encoding = encoding}));
      REQUIRE(io::write_ply(folder / "all.ply", chosen, {.encoding = encoding}));
      CHECK(orbis::read_file(folder / "some.ply").value() == orbis::read_file(folder / "all.ply").value());
    }
}

TEST_CASE("the binary PLY has the layout that other programs expect") {
  const orbis::test::temporary_folder folder;
  REQUIRE(io::write_ply(folder / "c.ply", orbis::point_cloud{{vec3f(1, 2, 3)}, {rgb8{4, 5, 6}}}));
  CHECK(orbis::read_file(folder / "c.ply").value() ==
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n" +
            std::string("\0\0\x80\x3F\0\0\0\x40\0\0\x40\x40\4\5\6", 15));
}

TEST_CASE("a range of foreign points is written as it lies") {
  const orbis::test::temporary_folder folder;
  const std::vector<std::array<double, 3>> points{{1, 2, 3}, {4, 5, 6}};
  REQUIRE(io::write_ply(folder / "c.ply", points, {}));
  CHECK(io::read_ply(folder / "c.ply").value().points == std::vector<vec3f>{{1, 2, 3}, {4, 5, 6}});
}

TEST_CASE("other properties and elements of a PLY are passed over in every encoding") {
  const std::string header =
      "element camera 2\nproperty list uchar short weights\nproperty double f\ncomment mind the gap\n"
      "element vertex 2\nproperty float nx\nproperty double z\nproperty short y\nproperty list int float more\n"
      "property int x\nproperty uchar blue\nproperty uchar green\nproperty uchar alpha\nproperty uchar red\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const auto check = [](const std::string& bytes) {
    const auto read = io::parse_ply(bytes);
    REQUIRE(read);
    CHECK(read->points == std::vector<vec3f>{{-70000, -2, 0.5F}, {3, 4, 1.5F}});
    CHECK(read->colors == std::vector<rgb8>{{30, 20, 10}, {33, 22, 11}});
  };
  check("ply\r\nformat ascii 1.0\r\n" + header +
        "2 1 2 0.5\n0 0.25\n9 0.5 -2 1 7 -70000 10 20 255 30\n9 1.5 4 0 3 11 22 255 33\n3 0 1 1\n");
  for (const auto order : {std::endian::little, std::endian::big}) {
    std::string bytes = std::string{"ply\nformat binary_"} + (order == std::endian::little ? "little" : "big") +
                        "_endian 1.0\n" + header;
    const auto put = [&](auto value) { append(bytes, value, order); };
    put(std::uint8_t{2}), put(std::int16_t{1}), put(std::int16_t{2}), put(0.5), put(std::uint8_t{0}), put(0.25);
    put(9.0F), put(0.5), put(std::int16_t{-2}), put(std::int32_t{1}), put(7.0F), put(std::int32_t{-70000});
    bytes += "\x0A\x14\xFF\x1E";
    put(9.0F), put(1.5), put(std::int16_t{4}), put(std::int32_t{0}), put(std::int32_t{3});
    bytes += "\x0B\x16\xFF\x21";
    put(std::uint8_t{1}), put(std::int32_t{0});
    check(bytes);
  }
}

TEST_CASE("colours of other types are brought to 8 bits") {
  const auto read =
      io::parse_ply(
          "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
          "property float red\nproperty ushort green\nproperty uchar blue\nend_header\n0 0 0 0.5 65535 7\n")
          .value();
  CHECK(read.colors == std::vector<rgb8>{{128, 255, 7}});
}

TEST_CASE("points that are not finite survive a PLY") {
  const orbis::test::temporary_folder folder;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const auto encoding : {io::ply_encoding::ascii, io::ply_encoding::binary}) {
    REQUIRE(io::write_ply(folder / "c.ply", orbis::point_cloud{{vec3f(nan, INFINITY, 1)}, {}}, {.encoding = encoding}));
    const auto p = io::read_ply(folder / "c.ply").value().points.at(0);
    CHECK(std::isnan(p.x()));
    CHECK(p.y() == INFINITY);
  }
}

TEST_CASE("every truncation of a PLY is an error") {
  const orbis::test::temporary_folder folder;
  for (const auto encoding : {io::ply_encoding::ascii, io::ply_encoding::binary}) {
    auto cloud = some_cloud(true);
    cloud.points.resize(5);
    cloud.colors.resize(5);
    REQUIRE(io::write_ply(folder / "c.ply", cloud, {.encoding = encoding}));
    const std::string good = orbis::read_file(folder / "c.ply").value();
    // Text without its last digit or line end is still a number.
    const std::size_t end = encoding == io::ply_encoding::ascii ? good.size() - 2 : good.size();
    for (std::size_t n = 0; n < end; ++n) CHECK_FALSE(io::parse_ply(std::string_view{good}.substr(0, n)));
  }
}

TEST_CASE("hostile PLY headers are refused without a large allocation") {
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  for (const char* count : {"18446744073709551615", "4000000000", "2"})
    for (const char* format : {"ascii", "binary_little_endian"}) {
      const auto read = io::parse_ply(std::string{"ply\nformat "} + format + " 1.0\nelement vertex " + count + "\n" +
                                      xyz + "end_header\n0 0 0\n");
      REQUIRE_FALSE(read);
      CHECK(read.error().code == orbis::errc::malformed);
    }
  const auto bad = [](const std::string& header) { return io::parse_ply("ply\n" + header, "f.ply").error().message; };
  CHECK(bad("element vertex 1\n" + xyz + "end_header\n0 0 0\n").find("no format") != std::string::npos);
  CHECK(bad("format ascii 1.0\nelement vertex -1\nend_header\n").find("invalid element") != std::string::npos);
  CHECK(bad("format ascii 1.0\nproperty float x\n").find("before any element") != std::string::npos);
  CHECK(bad("format ascii 1.0\nelement vertex 1\nproperty half x\n").find("unknown type") != std::string::npos);
  CHECK(bad("format ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n").find("lack x, y or z") !=
        std::string::npos);
  CHECK(bad("format ascii 1.0\nelement face 0\nproperty list uchar int i\nend_header\n") == "there are no vertices");
  CHECK(bad("format binary_little_endian 1.0\nelement face 1\nproperty list uint double i\nelement vertex 1\n" + xyz +
            "end_header\n\xFF\xFF\xFF\xFF")
            .find("ends early") != std::string::npos);
  CHECK(io::parse_ply("solid stl").error().message == "is not a PLY file");
}
