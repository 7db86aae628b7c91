// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/bytes.hpp>
#include <orbis/core/file.hpp>
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

TEST_CASE("the extension of a path is the format of a cloud, in upper and lower case") {
  const orbis::test::temporary_folder folder;
  const io::cloud_with_fields cloud{.cloud = {{{1, 2, 3}}, {}}, .fields = {}, .notes = {}};
  const std::vector<std::uint32_t> all{0};
  for (const auto& [name, begin] :
       {std::pair{"a.PLY", "ply\n"}, {"a.Ply", "ply\n"}, {"a.pcd", "# .PCD"}, {"a.PCD", "# .PCD"}}) {
    REQUIRE(io::write_cloud(folder / name, cloud, all));
    const auto bytes = orbis::read_file(folder / name).value();
    CHECK(bytes.starts_with(begin));
    CHECK(io::read_cloud(folder / name).value().points == cloud.cloud.points);
  }
  CHECK(io::read_cloud(folder.write("b.PCD", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nDATA ascii\n1 2 3\n")));
  for (const char* name : {"a.xyz", "a", ".ply", "a.plyx"}) {
    CHECK_FALSE(io::cloud_format_by_extension(folder / name));
    CHECK(io::write_cloud(folder / name, cloud, all).error().code == orbis::errc::invalid_argument);
    CHECK_FALSE(std::filesystem::exists(folder / name));
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
