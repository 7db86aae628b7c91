// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <string>

#include <orbis/core/bytes.hpp>
#include <orbis/io/cloud_file.hpp>
#include <orbis/io/pcd.hpp>
#include <orbis/io/ply.hpp>

#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

namespace io = orbis::io;

TEST_CASE("a cloud is read whatever its file is called") {
  const orbis::test::temporary_folder folder;
  const orbis::point_cloud cloud{{{1, 2, 3}, {4, 5, 6}}, {{1, 2, 3}, {4, 5, 6}}};
  for (const char* name : {"a.ply", "a.dat"}) {
    REQUIRE(io::write_ply(folder / name, cloud));
    CHECK(io::read_cloud(folder / name).value().points == cloud.points);
  }
  for (const char* name : {"b.pcd", "b.dat"}) {
    REQUIRE(io::write_pcd(folder / name, cloud));
    CHECK(io::read_cloud(folder / name).value().colors == cloud.colors);
  }
}

TEST_CASE("what is not a cloud is refused") {
  const orbis::test::temporary_folder folder;
  CHECK(io::read_cloud(folder.write("a.txt", "hello")).error().code == orbis::errc::unsupported);
  CHECK(io::read_cloud(folder.write("a.ply", "hello")).error().code == orbis::errc::malformed);
  CHECK(io::read_cloud(folder.write("a.pcd", "")).error().code == orbis::errc::malformed);
  CHECK(io::read_cloud(folder / "none.ply").error().code == orbis::errc::not_found);
}

TEST_CASE("a cloud far from the origin keeps its millimetres when the origin is taken off") {
  const orbis::test::temporary_folder folder;
  const orbis::vec3 origin{455000.0, 5430000.0, 100.0};
  const std::string numbers = "455000.125 5430001.003 100.5\n";
  const auto check = [&](const std::filesystem::path& file) {
    const auto cloud = io::read_cloud(file, origin).value();
    REQUIRE(cloud.size() == 1);
    CHECK((cloud.points[0] - orbis::vec3f{0.125F, 1.003F, 0.5F}).norm() < 1e-6F);
  };
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double y\n"
      "property double z\nend_header\n";
  check(folder.write("a.ply", ply + numbers));
  const std::string pcd = "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ";
  check(folder.write("a.pcd", pcd + "ascii\n" + numbers));
  std::string bytes;
  for (const double v : {455000.125, 5430001.003, 100.5}) orbis::append_little_endian(bytes, v);
  check(folder.write("b.pcd", pcd + "binary\n" + bytes));
}
