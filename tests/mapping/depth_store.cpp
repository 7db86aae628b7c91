// SPDX-License-Identifier: BSD-3-Clause
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <sys/resource.h>
#include <unistd.h>

#include <orbis/core/random.hpp>
#include <orbis/mapping/depth_store.hpp>

#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;
using orbis::errc;
using orbis::mapping::depth_store;
using depth_image = orbis::image<std::uint16_t>;

struct scratch : orbis::test::temporary_folder {
  [[nodiscard]] fs::path spill() const { return path() / "depths.tmp"; }
  [[nodiscard]] bool empty() const { return fs::is_empty(path()); }
};

/// Noise that takes 2 kB and more when it is compressed; different for each seed.
depth_image noise(std::uint32_t seed, int width = 64, int height = 48) {
  orbis::random_bits random{seed};
  depth_image out(width, height);
  for (auto& v : out.pixels()) v = static_cast<std::uint16_t>(random.below(4) == 0 ? 0 : 700 + 10 * random.below(60));
  return out;
}

depth_image get(const depth_store& store, std::uint64_t frame) {
  depth_image out;
  const auto done = store.get(frame, out);
  INFO((done ? std::string{} : done.error().to_string()));
  REQUIRE(done);
  return out;
}

/// While it lives, files cannot grow beyond so many bytes, as on a full disk.
class full_disk {
 public:
  explicit full_disk(rlim_t bytes) : handler_{std::signal(SIGXFSZ, SIG_IGN)} {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~full_disk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  full_disk(const full_disk&) = delete;
  full_disk& operator=(const full_disk&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST_CASE("images come back from the store as they were") {
  depth_store store;
  std::vector<depth_image> images{noise(1),          noise(2, 1, 1), depth_image(64, 48), depth_image(7, 5, 65535),
                                  depth_image(0, 0), noise(3, 33, 1)};
  for (std::size_t i = 0; i != images.size(); ++i) REQUIRE(store.put(i, images[i]));
  CHECK(store.size() == images.size());
  CHECK(store.bytes_spilled() == 0);
  for (std::size_t i = 0; i != images.size(); ++i) CHECK(get(store, i) == images[i]);
}

TEST_CASE("what is not in the store is not found") {
  depth_store store;
  REQUIRE(store.put(7, noise(1)));
  CHECK(store.contains(7));
  CHECK_FALSE(store.contains(8));
  depth_image out;
  const auto missing = store.get(8, out);
  REQUIRE_FALSE(missing);
  CHECK(missing.error().code == errc::not_found);
  CHECK(missing.error().where == "frame 8");
  CHECK_FALSE(store.erase(8));
  CHECK(store.erase(7));
  CHECK_FALSE(store.contains(7));
  CHECK(store.size() == 0);
  CHECK(store.bytes_in_memory() == 0);
}

TEST_CASE("removed pixels are 0 until another call restores them") {
  const scratch folder;
  for (const std::size_t budget : {std::size_t{1} << 20U, std::size_t{0}}) {
    depth_store store{{.memory_budget = budget, .spill_file = folder.spill()}};
    const depth_image whole = noise(1), none(64, 48);
    depth_image holes = whole, others = whole;
    for (int y = 0; y != 48; ++y)
      for (int x = 0; x != 64; ++x) (x % 7 < 3 || y == 20 ? holes : others)(x, y) = 0;
    CHECK(store.mask(1, holes).error().where == "frame 1");
    REQUIRE(store.put(1, whole));
    REQUIRE(store.put(2, depth_image(0, 0)));
    const std::size_t packed = store.bytes_in_memory() + store.bytes_spilled();
    for (const depth_image& masked : {holes, none, others, whole, holes}) {
      REQUIRE(store.mask(1, masked));
      CHECK(get(store, 1) == masked);
      depth_image again;
      REQUIRE(store.get_whole(1, again));
      CHECK(again == whole);
    }
    REQUIRE(store.mask(2, depth_image(0, 0)));
    CHECK(get(store, 2) == depth_image(0, 0));
    CHECK(store.bytes_in_memory() + store.bytes_spilled() > packed);
    CHECK(store.bytes_in_memory() + store.bytes_spilled() < packed + 64 * 48 / 4);
    REQUIRE(store.put(1, whole));  // a new image has all its pixels
    CHECK(get(store, 1) == whole);
    REQUIRE(store.mask(1, none));
    store.erase(1);
    store.erase(2);
    CHECK(store.bytes_in_memory() + store.bytes_spilled() == 0);
  }
}

TEST_CASE("a mask of another size is refused, and the image remains") {
  depth_store store;
  REQUIRE(store.put(1, noise(1)));
  for (const depth_image& other : {depth_image(64, 47), depth_image(48, 64), depth_image(0, 0), depth_image(128, 96)}) {
    const auto masked = store.mask(1, other);
    REQUIRE_FALSE(masked);
    CHECK(masked.error().code == errc::invalid_argument);
    CHECK(masked.error().where == "frame 1");
  }
  CHECK(store.mask(1, depth_image(32, 24)).error().message ==
        "the mask has 32 x 24 pixels, but the depth image has 64 x 48");
  CHECK(get(store, 1) == noise(1));
}

TEST_CASE("a mask does not count as a use of the image") {
  const scratch folder;
  depth_store store{{.memory_budget = 20000, .spill_file = folder.spill()}};
  for (std::uint32_t i = 0; i != 4; ++i) REQUIRE(store.put(i, noise(i)));
  REQUIRE(store.mask(0, depth_image(64, 48)));  // 0 remains the oldest
  for (std::uint32_t i = 4; store.bytes_spilled() == 0; ++i) REQUIRE(store.put(i, noise(i)));
  REQUIRE(store.erase(0));
  CHECK(store.bytes_spilled() == 0);
}

TEST_CASE("a second image of a frame takes the place of the first") {
  const scratch folder;
  for (const std::size_t budget : {std::size_t{1} << 20U, std::size_t{0}}) {
    depth_store store{{.memory_budget = budget, .spill_file = folder.spill()}};
    REQUIRE(store.put(1, noise(1)));
    const std::size_t once = store.bytes_in_memory() + store.bytes_spilled();
    REQUIRE(store.put(1, noise(2)));
    CHECK(get(store, 1) == noise(2));
    REQUIRE(store.put(1, noise(1)));
    CHECK(store.bytes_in_memory() + store.bytes_spilled() == once);
    CHECK(store.size() == 1);
  }
}

TEST_CASE("beyond the budget, images go to the file, those that were not used longest first") {
  const scratch folder;
  constexpr std::size_t budget = 20000;
  depth_store store{{.memory_budget = budget, .spill_file = folder.spill()}};
  for (std::uint32_t i = 0; i != 4; ++i) REQUIRE(store.put(i, noise(i)));
  REQUIRE(store.bytes_spilled() == 0);
  get(store, 0);  // 1 is the oldest now
  const std::size_t in_four = store.bytes_in_memory();
  for (std::uint32_t i = 4; store.bytes_spilled() == 0; ++i) REQUIRE(store.put(i, noise(i)));
  CHECK(store.bytes_in_memory() <= budget);
  const std::size_t spilled = store.bytes_spilled();
  REQUIRE(spilled < in_four / 2);
  CHECK(store.erase(0));
  CHECK(store.bytes_spilled() == spilled);  // it was in memory
  CHECK(store.erase(1));
  CHECK(store.bytes_spilled() == 0);

  for (std::uint32_t i = 0; i != 100; ++i) {
    REQUIRE(store.put(i, noise(i)));
    REQUIRE(store.bytes_in_memory() <= budget);
  }
  CHECK(store.bytes_spilled() > 5 * budget);
  for (std::uint32_t i = 0; i != 100; ++i) REQUIRE(get(store, i) == noise(i));
}

TEST_CASE("the store behaves as a map of images does") {
  const scratch folder;
  depth_store store{{.memory_budget = 12000, .spill_file = folder.spill()}};
  std::map<std::uint64_t, depth_image> expected;
  orbis::random_bits random{9};
  for (std::uint32_t step = 0; step != 2000; ++step) {
    const std::uint64_t frame = random.below(30);
    switch (random.below(4)) {
      case 0: REQUIRE(store.erase(frame) == (expected.erase(frame) != 0)); break;
      case 1:
        if (expected.contains(frame)) REQUIRE(get(store, frame) == expected[frame]);
        break;
      default: {
        const auto size = [&] { return static_cast<int>(1 + random.below(50)); };
        expected[frame] = noise(step, size(), size());
        REQUIRE(store.put(frame, expected[frame]));
      }
    }
    REQUIRE(store.size() == expected.size());
    REQUIRE(store.bytes_in_memory() <= 12000);
  }
  for (const auto& [frame, image] : expected) CHECK(get(store, frame) == image);
  for (const auto& [frame, image] : expected) REQUIRE(store.erase(frame));
  CHECK(store.bytes_in_memory() == 0);
  CHECK(store.bytes_spilled() == 0);
}

TEST_CASE("without a spill file everything stays in memory") {
  depth_store store{{.memory_budget = 10}};
  for (std::uint32_t i = 0; i != 10; ++i) REQUIRE(store.put(i, noise(i)));
  CHECK(store.bytes_in_memory() > 10000);
  CHECK(store.bytes_spilled() == 0);
}

TEST_CASE("a store leaves no file, moved or not") {
  const scratch folder;
  {
    depth_store store{{.memory_budget = 0, .spill_file = folder.spill()}};
    CHECK(folder.empty());  // until it is needed
    for (std::uint32_t i = 0; i != 5; ++i) REQUIRE(store.put(i, noise(i)));
    CHECK(store.bytes_spilled() > 0);
    CHECK(folder.empty());  // nothing is left behind, even by a process that is killed
    depth_store moved{std::move(store)};
    CHECK(get(moved, 3) == noise(3));
    depth_store assigned{{.memory_budget = 0, .spill_file = folder.spill()}};
    REQUIRE(assigned.put(3, noise(30)));
    assigned = std::move(moved);
    REQUIRE(assigned.put(5, noise(5)));
    for (std::uint32_t i = 0; i != 6; ++i) CHECK(get(assigned, i) == noise(i));
  }
  CHECK(folder.empty());
}

TEST_CASE("a spill file that cannot be made is told, and nothing is lost") {
  const scratch folder;
  std::ofstream{folder / "taken"} << "somebody's";
  for (const fs::path& path : {folder / "none" / "depths.tmp", folder / "taken", fs::path{"/dev/full"}}) {
    depth_store store{{.memory_budget = 0, .spill_file = path}};
    for (std::uint32_t i = 0; i != 3; ++i) {
      const auto kept = store.put(i, noise(i));
      REQUIRE_FALSE(kept);
      CHECK(kept.error().code == errc::write_failed);
      CHECK(kept.error().where == path.string());
      CHECK_FALSE(kept.error().message.empty());
    }
    CHECK(store.bytes_spilled() == 0);
    for (std::uint32_t i = 0; i != 3; ++i) CHECK(get(store, i) == noise(i));
  }
  std::string content;
  std::ifstream{folder / "taken"} >> content;
  CHECK(content == "somebody's");
}

TEST_CASE("on a full disk nothing is lost, and the store goes on when there is room") {
  const scratch folder;
  depth_store store{{.memory_budget = 0, .spill_file = folder.spill()}};
  std::size_t failed = 0;
  {
    const full_disk at{20000};
    for (std::uint32_t i = 0; i != 20; ++i) {
      const auto kept = store.put(i, noise(i));
      if (kept) continue;
      ++failed;
      CHECK(kept.error().code == errc::write_failed);
      CHECK(kept.error().to_string().find(folder.spill().string()) != std::string::npos);
    }
    CHECK(failed > 5);
    CHECK(failed < 20);
    CHECK(store.bytes_spilled() > 10000);
    CHECK(store.bytes_spilled() <= 20000);
    CHECK(store.bytes_in_memory() > 10000);
    for (std::uint32_t i = 0; i != 20; ++i) CHECK(get(store, i) == noise(i));
    // Room in the file is used again.
    REQUIRE(store.erase(1));
    REQUIRE(store.erase(2));
    const std::size_t before = store.bytes_spilled();
    CHECK_FALSE(store.put(30, noise(30)));
    CHECK(store.bytes_spilled() > before);
  }
  REQUIRE(store.put(31, noise(31)));
  CHECK(store.bytes_in_memory() == 0);
  CHECK(get(store, 19) == noise(19));
  CHECK(get(store, 31) == noise(31));
}

TEST_CASE("threads read at the same time") {
  const scratch folder;
  depth_store store{{.memory_budget = 8000, .spill_file = folder.spill()}};
  for (std::uint32_t i = 0; i != 12; ++i) REQUIRE(store.put(i, noise(i)));
  std::vector<std::size_t> wrong(3, 0);
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t != wrong.size(); ++t)
    threads.emplace_back([&store, &bad = wrong[t], t] {
      depth_image out;
      for (std::uint32_t i = 0; i != 60; ++i) {
        const auto frame = static_cast<std::uint32_t>((i + 5 * t) % 12);
        if (!store.get(frame, out) || !(out == noise(frame))) ++bad;
      }
    });
  for (std::thread& t : threads) t.join();
  CHECK(wrong == std::vector<std::size_t>(3, 0));
}

}  // namespace
