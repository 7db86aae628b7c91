// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <orbis/core/file.hpp>
#include <orbis/io/pcd.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/temporary_folder.hpp"

namespace io = orbis::io;
using orbis::rgb8;
using orbis::vec3f;

namespace {

constexpr io::pcd_encoding encodings[] = {io::pcd_encoding::ascii, io::pcd_encoding::binary,
                                          io::pcd_encoding::binary_compressed};

io::organized_cloud some_cloud(bool colored) {
  io::organized_cloud out{{}, 6, 4};
  for (int i = 0; i != 24; ++i) {
    const auto f = static_cast<float>(i);
    if (i % 5 == 0)
      out.cloud.points.push_back(vec3f::Constant(std::numeric_limits<float>::quiet_NaN()));
    else
      out.cloud.points.emplace_back(f / 3.0F, -1e-7F * f, 1e6F / f);
    if (colored)
      out.cloud.colors.push_back(
          {static_cast<std::uint8_t>(10 * i), static_cast<std::uint8_t>(255 - i), static_cast<std::uint8_t>(7 * i)});
  }
  return out;
}

bool same_points(const orbis::point_cloud& a, const orbis::point_cloud& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i != a.size(); ++i)
    for (int k = 0; k != 3; ++k)
      if (a.points[i][k] != b.points[i][k] && !(std::isnan(a.points[i][k]) && std::isnan(b.points[i][k]))) return false;
  return true;
}

std::string header(const std::string& lines) {
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n" + lines;
}

}  // namespace

TEST_CASE("clouds survive writing and reading a PCD with their shape and NaN") {
  const orbis::test::temporary_folder folder;
  for (const auto encoding : encodings)
    for (const bool colored : {false, true}) {
      const auto out = some_cloud(colored);
      REQUIRE(io::write_pcd(folder / "c.pcd", out, {.encoding = encoding}));
      const auto read = io::read_organized_pcd(folder / "c.pcd").value();
      CHECK(read.width == 6);
      CHECK(read.height == 4);
      CHECK(same_points(read.cloud, out.cloud));
      CHECK(read.cloud.colors == out.cloud.colors);
      REQUIRE(io::write_pcd(folder / "flat.pcd", out.cloud, {.encoding = encoding}));
      CHECK(same_points(io::read_pcd(folder / "flat.pcd").value(), out.cloud));
      CHECK(io::read_organized_pcd(folder / "flat.pcd").value().height == 1);
    }
}

TEST_CASE("a shape that is not that of the points is refused") {
  const orbis::test::temporary_folder folder;
  auto cloud = some_cloud(false);
  cloud.width = 5;
  CHECK(io::write_pcd(folder / "c.pcd", cloud).error().code == orbis::errc::invalid_argument);
}

TEST_CASE("an empty cloud survives a PCD") {
  const orbis::test::temporary_folder folder;
  for (const auto encoding : encodings) {
    REQUIRE(io::write_pcd(folder / "c.pcd", orbis::point_cloud{}, {.encoding = encoding}));
    CHECK(io::read_pcd(folder / "c.pcd").value().empty());
  }
}

TEST_CASE("fields of other types and in another order are read from text") {
  const auto read =
      io::parse_pcd(
          header(
              "FIELDS normal z rgba y x _\nSIZE 4 8 4 2 4 1\nTYPE F F U I F U\nCOUNT 3 1 1 1 1 2\nWIDTH 2\nHEIGHT 1\n"
              "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n9 9 9 0.5 4278255361 -2 1e3 0 0\r\n9 9 9 nan 66051 4 3 0 "
              "0\r\n"))
          .value();
  CHECK(read.cloud.points[0] == vec3f(1000, -2, 0.5F));
  CHECK(std::isnan(read.cloud.points[1].z()));
  CHECK(read.cloud.colors == std::vector<rgb8>{{0, 255, 1}, {1, 2, 3}});
}

TEST_CASE("colours packed into a float are read from text") {
  float packed = 0.0F;
  const std::uint32_t bits = 0x00FF8001;
  std::memcpy(&packed, &bits, 4);
  char text[64];
  std::snprintf(text, sizeof text, "%.9g", static_cast<double>(packed));
  const auto read = io::parse_pcd(header("FIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 1\nHEIGHT "
                                         "1\nPOINTS 1\nDATA ascii\n1 2 3 ") +
                                  text + "\n")
                        .value();
  CHECK(read.cloud.colors == std::vector<rgb8>{{255, 128, 1}});
}

TEST_CASE("every truncation of a PCD is an error") {
  const orbis::test::temporary_folder folder;
  for (const auto encoding : encodings) {
    REQUIRE(io::write_pcd(folder / "c.pcd", some_cloud(true), {.encoding = encoding}));
    const std::string good = orbis::read_file(folder / "c.pcd").value();
    // Text without the last digits of its last number is still a number.
    const std::size_t end = encoding == io::pcd_encoding::ascii ? good.rfind(' ') + 1 : good.size();
    for (std::size_t n = 0; n < end; ++n) {
      INFO(n << " of " << good.size() << " bytes");
      CHECK_FALSE(io::parse_pcd(std::string_view{good}.substr(0, n)));
    }
  }
}

TEST_CASE("a changed byte never crashes the PCD reader") {
  const orbis::test::temporary_folder folder;
  std::size_t refused = 0;
  for (const auto encoding : encodings) {
    REQUIRE(io::write_pcd(folder / "c.pcd", some_cloud(true), {.encoding = encoding}));
    const std::string good = orbis::read_file(folder / "c.pcd").value();
    for (std::size_t i = 0; i != good.size(); ++i)
      for (const int flip : {0x01, 0x80, 0xFF}) {
        std::string bad = good;
        bad[i] = static_cast<char>(bad[i] ^ flip);
        refused += io::parse_pcd(bad) ? 0 : 1;
      }
  }
  CHECK(refused > 0);
}

TEST_CASE("hostile PCD headers are refused without a large allocation") {
  const std::string fields = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n";
  const auto refused = [&](const std::string& lines) {
    const auto read = io::parse_pcd(header(lines), "c.pcd");
    return read ? std::string{} : std::string{orbis::to_string(read.error().code)};
  };
  for (const char* data : {"ascii\n0 0 0\n", "binary\n0123456789ab", "binary_compressed\n\1\0\0\0\xFF\xFF\xFF\xFF"})
    for (const char* count : {"1000000000", "18446744073709551615", "-5", "3"})
      CHECK(refused(fields + "WIDTH " + count + "\nHEIGHT 1\nPOINTS " + count + "\nDATA " + data) == "malformed");
  CHECK(refused(fields + "WIDTH 4294967296\nHEIGHT 4294967296\nPOINTS 0\nDATA binary\n") == "malformed");
  CHECK(refused(fields + "WIDTH 2\nHEIGHT 1\nPOINTS 1\nDATA ascii\n0 0 0\n") == "malformed");
  CHECK(refused(fields + "DATA ascii\n0 0 0\n") == "malformed");
  CHECK(refused("FIELDS x y z\nSIZE 4 4 3\nTYPE F F F\nWIDTH 1\nDATA ascii\n0 0 0\n") == "malformed");
  CHECK(refused("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1000000000\nWIDTH 1\nDATA ascii\n0 0 0\n") ==
        "malformed");
  // Points of many numbers, of which the data hold few.
  CHECK(refused("FIELDS x y z n\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 60000\nWIDTH 1\nDATA ascii\n0 0 0 1\n") ==
        "malformed");
  CHECK(refused("FIELDS x y\nSIZE 4 4\nTYPE F F\nWIDTH 1\nDATA ascii\n0 0\n") == "unsupported");
  CHECK(refused(fields + "WIDTH 1\nHEIGHT 1\nDATA ascii\n0 zero 0\n") == "malformed");
}

TEST_CASE("an unorganised cloud in binary is read from a real file") {
  ORBIS_NEEDS_DATA("clouds/fragment.pcd");
  const auto read = io::read_organized_pcd(orbis::test::data_dir() / "clouds" / "fragment.pcd").value();
  CHECK(read.cloud.size() == 113662);
  CHECK(read.width == 113662);
  CHECK(read.cloud.colors.size() == 113662);
  vec3f low = read.cloud.points[0], high = low;
  for (const vec3f& p : read.cloud.points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  CHECK((high - low).maxCoeff() < 10.0F);  // a piece of a room
  CHECK((high - low).minCoeff() > 0.5F);
}

TEST_CASE("an organised cloud with compression and NaN is read from a real file") {
  ORBIS_NEEDS_DATA("clouds/table_scene_mug_stereo_textured.pcd");
  const auto read =
      io::read_organized_pcd(orbis::test::data_dir() / "clouds" / "table_scene_mug_stereo_textured.pcd").value();
  CHECK(read.width == 640);
  CHECK(read.height == 480);
  std::size_t finite = 0;
  for (const vec3f& p : read.cloud.points) finite += p.allFinite() ? 1 : 0;
  CHECK(finite == 209280);
  const orbis::test::temporary_folder folder;
  REQUIRE(io::write_pcd(folder / "c.pcd", read));
  const auto again = io::read_organized_pcd(folder / "c.pcd").value();
  CHECK(same_points(again.cloud, read.cloud));
  CHECK(again.cloud.colors == read.cloud.colors);
}
