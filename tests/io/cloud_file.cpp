// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/io/cloud_file.hpp>

#include "support/temporary_folder.hpp"
#include "support/catch.hpp"

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
