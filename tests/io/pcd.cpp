// SPDX-License-Identifier: BSD-3-Clause
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/core/file.hpp>
#include <orbis/io/pcd.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/temporary_folder.hpp"

namespace io = orbis::io;
using orbis::rgb8;
using orbis::vec3f;

namespace {

constexpr const char* encodings[] = {"ascii", "binary", "binary_compressed"};

orbis::point_cloud some_cloud(bool colored) {
  orbis::point_cloud out;
  for (int i = 0; i != 24; ++i) {
    const auto f = static_cast<float>(i);
    if (i % 5 == 0)
      out.points.push_back(vec3f::Constant(std::numeric_limits<float>::quiet_NaN()));
    else
      out.points.emplace_back(f / 3.0F, -1e-7F * f, 1e6F / f);
    if (colored)
      out.colors.push_back(
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

/// A file with this encoding, as others write it.
std::string file_of(const orbis::point_cloud& cloud, const std::string& encoding) {
  if (encoding == "binary_compressed") {
    const orbis::test::temporary_folder folder;
    REQUIRE(io::write_pcd(folder / "c.pcd", cloud));
    return orbis::read_file(folder / "c.pcd").value();
  }
  const std::string n = std::to_string(cloud.size());
  std::string bytes = header(cloud.has_colors() ? "FIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
                                                : "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n") +
                      "WIDTH " + n + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA " + encoding + "\n";
  for (std::size_t i = 0; i != cloud.size(); ++i) {
    std::vector<float> numbers(cloud.points[i].begin(), cloud.points[i].end());
    if (cloud.has_colors()) {
      const rgb8& c = cloud.colors[i];
      numbers.push_back(
          std::bit_cast<float>(std::uint32_t{c.r} << 16U | std::uint32_t{c.g} << 8U | std::uint32_t{c.b}));
    }
    for (const float v : numbers) {
      if (encoding == "binary") {
        orbis::append_little_endian(bytes, v);
      } else {
        char text[64];
        std::snprintf(text, sizeof text, "%.9g ", static_cast<double>(v));
        bytes += text;
      }
    }
    if (encoding == "ascii") bytes.back() = '\n';
  }
  return bytes;
}

}  // namespace

TEST_CASE("clouds survive writing and reading a PCD with NaN") {
  const orbis::test::temporary_folder folder;
  for (const bool colored : {false, true}) {
    const auto out = some_cloud(colored);
    for (const char* encoding : encodings) {
      const auto read = io::parse_pcd(file_of(out, encoding)).value();
      CHECK(same_points(read, out));
      CHECK(read.colors == out.colors);
    }
    REQUIRE(io::write_pcd(folder / "c.pcd", out));
    CHECK(same_points(io::read_pcd(folder / "c.pcd").value(), out));
  }
}

TEST_CASE("an empty cloud survives a PCD") {
  for (const char* encoding : encodings) CHECK(io::parse_pcd(file_of({}, encoding)).value().empty());
}

TEST_CASE("fields of other types and in another order are read from text") {
  const auto read =
      io::parse_pcd(
          header(
              "FIELDS normal z rgba y x _\nSIZE 4 8 4 2 4 1\nTYPE F F U I F U\nCOUNT 3 1 1 1 1 2\nWIDTH 2\nHEIGHT 1\n"
              "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n9 9 9 0.5 4278255361 -2 1e3 0 0\r\n9 9 9 nan 66051 4 3 0 "
              "0\r\n"))
          .value();
  CHECK(read.points[0] == vec3f(1000, -2, 0.5F));
  CHECK(std::isnan(read.points[1].z()));
  CHECK(read.colors == std::vector<rgb8>{{0, 255, 1}, {1, 2, 3}});
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
  CHECK(read.colors == std::vector<rgb8>{{255, 128, 1}});
}

TEST_CASE("every truncation of a PCD is an error") {
  for (const std::string encoding : encodings) {
    const std::string good = file_of(some_cloud(true), encoding);
    // Text without the last digits of its last number is still a number.
    const std::size_t end = encoding == "ascii" ? good.rfind(' ') + 1 : good.size();
    for (std::size_t n = 0; n < end; ++n) {
      INFO(n << " of " << good.size() << " bytes");
      CHECK_FALSE(io::parse_pcd(std::string_view{good}.substr(0, n)));
    }
  }
}

TEST_CASE("a changed byte never crashes the PCD reader") {
  std::size_t refused = 0;
  for (const char* encoding : encodings) {
    const std::string good = file_of(some_cloud(true), encoding);
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
  const auto read = io::read_pcd(orbis::test::data_dir() / "clouds" / "fragment.pcd").value();
  CHECK(read.size() == 113662);
  CHECK(read.colors.size() == 113662);
  vec3f low = read.points[0], high = low;
  for (const vec3f& p : read.points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  CHECK((high - low).maxCoeff() < 10.0F);  // a piece of a room
  CHECK((high - low).minCoeff() > 0.5F);
}

TEST_CASE("an organised cloud with compression and NaN is read from a real file") {
  ORBIS_NEEDS_DATA("clouds/table_scene_mug_stereo_textured.pcd");
  const auto read = io::read_pcd(orbis::test::data_dir() / "clouds" / "table_scene_mug_stereo_textured.pcd").value();
  CHECK(read.size() == 640 * 480);
  std::size_t finite = 0;
  for (const vec3f& p : read.points) finite += p.allFinite() ? 1 : 0;
  CHECK(finite == 209280);
  const orbis::test::temporary_folder folder;
  REQUIRE(io::write_pcd(folder / "c.pcd", read));
  const auto again = io::read_pcd(folder / "c.pcd").value();
  CHECK(same_points(again, read));
  CHECK(again.colors == read.colors);
}
