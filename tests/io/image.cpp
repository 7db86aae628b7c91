// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <filesystem>

#include <sys/resource.h>
#include <sys/stat.h>

#include <orbis/io/image.hpp>
#include <orbis/io/png.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/temporary_folder.hpp"

namespace io = orbis::io;

TEST_CASE("what is not an image is named with its fault") {
  const orbis::test::temporary_folder folder;
  const auto text = folder.write("a.png", "this is not an image at all");
  CHECK(io::read_color(text).error().code == orbis::errc::unsupported);
  CHECK(io::read_depth(text).error().code == orbis::errc::unsupported);
  const auto empty = folder.write("b.png", "");
  CHECK(io::read_color(empty).error().to_string() == empty.string() + ": the file is empty");
  CHECK(io::read_depth(empty).error().code == orbis::errc::malformed);
  CHECK(io::read_color(folder / "c.png").error().code == orbis::errc::not_found);
  CHECK(io::read_depth(folder.path()).error().code == orbis::errc::unreadable);
}

TEST_CASE("nobody waits for an image that is a pipe") {
  const orbis::test::temporary_folder folder;
  const auto pipe = folder / "pipe.png";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  CHECK(io::read_color(pipe).error().to_string() == pipe.string() + ": is not a regular file");
  CHECK(io::read_depth(pipe).error().code == orbis::errc::unreadable);
}

TEST_CASE("a file larger than any image is refused before it is read") {
  const orbis::test::temporary_folder folder;
  const auto large = folder.write("large.png", "\x89PNG\r\n\x1a\n");
  std::filesystem::resize_file(large, (std::uintmax_t{1} << 30) + 1);  // takes no space
  const auto peak_kilobytes = [] {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
  };
  const auto before = peak_kilobytes();
  const auto color = io::read_color(large);
  const auto depth = io::read_depth(large);
  CHECK(peak_kilobytes() - before < 40'000);
  for (const auto& error : {color.error(), depth.error()}) {
    CHECK(error.code == orbis::errc::malformed);
    CHECK(error.message == "is larger than 1073741824 bytes, the limit for such files");
  }
}

TEST_CASE("the kind of an image is what its bytes say") {
  const orbis::test::temporary_folder folder;
  const orbis::image<orbis::rgb8> one(1, 1, {1, 2, 3});
  const auto file = folder.write("really_png.jpg", io::encode_png(one));
  CHECK(io::read_color(file).value() == one);
}

TEST_CASE("images of a real recording are read") {
  ORBIS_NEEDS_DATA("fr1_desk_9");
  const auto folder = orbis::test::data_dir() / "fr1_desk_9";
  const auto color = io::read_color(folder / "rgb" / "1305031453.359684.png").value();
  CHECK(color.width() == 640);
  CHECK(color.height() == 480);
  const auto depth = io::read_depth(folder / "depth" / "1305031453.374112.png").value();
  CHECK(depth.width() == 640);
  std::size_t valid = 0;
  double sum = 0.0;
  for (const auto d : depth.pixels())
    if (d != 0) {
      ++valid;
      sum += d / 5000.0;
    }
  CHECK(valid > 200000);
  CHECK(sum / static_cast<double>(valid) > 0.5);  // a desk, in metres
  CHECK(sum / static_cast<double>(valid) < 3.0);
}
