// SPDX-License-Identifier: BSD-3-Clause
#include "common/memory.hpp"

#include <cstddef>
#include <cstdint>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/voxel_estimate.hpp"
#include "support/catch.hpp"

#ifdef __linux__
#include <sys/wait.h>
#include <unistd.h>
#endif

namespace {

const std::string meminfo =
    "MemTotal:       4000000 kB\nMemFree:  900000 kB\nMemAvailable:    2000000 kB\nBuffers: 1 kB\n";

}  // namespace

TEST_CASE("free memory is what the system has, or what is left of a control group's") {
  using examples::free_memory;
  CHECK(free_memory(meminfo, {}) == 2'048'000'000U);
  CHECK(free_memory(meminfo, {"max\n", "5", ""}) == 2'048'000'000U);
  CHECK(free_memory(meminfo, {"9223372036854771712\n", "5", ""}) == 2'048'000'000U);
  CHECK(free_memory(meminfo, {"99999999999999999999999\n", "5", ""}) == 2'048'000'000U);
  CHECK(free_memory(meminfo, {"1000000000\n", "600000000\n", ""}) == 400'000'000U);
  CHECK(free_memory(meminfo, {"1000000000\n", "1200000000\n", ""}) == 0U);
  // Files that are kept for the next time are given back.
  CHECK(free_memory(meminfo, {"1000000000\n", "900000000\n",
                              "anon 100000000\nfile 800000000\ninactive_file 700000000\nactive_file 50000000\n"}) ==
        850'000'000U);
  CHECK_FALSE(free_memory("", {"1000000000\n", "600000000\n", ""}));
  CHECK_FALSE(free_memory("MemAvailable: many kB\n", {}));
}

TEST_CASE("an octree that does not fit is told from the image's rays") {
  examples::voxel_estimate rays;
  rays.add(0.0, 0.4);  // cubic metres
  CHECK_FALSE(rays.takes_long(0.01));
  rays.add(1e9, 0.0);
  CHECK(rays.takes_long(0.001));
  CHECK_FALSE(rays.is_too_large(0.001, std::nullopt));
  CHECK_FALSE(rays.is_too_large(0.001, 3'300'000'000U));
  CHECK(rays.is_too_large(0.001, 3'100'000'000U));
  CHECK(rays.is_too_large(0.0005, std::nullopt));
  CHECK(rays.describe(0.001, "it") == "it has about 0.4 billion voxels of 1 mm (3.2 GB)");
}

TEST_CASE("who gives up says why") {
  CHECK(examples::describe_exception(std::bad_alloc{}) == "out of memory");
  CHECK(examples::describe_exception(std::runtime_error{"no threads"}) == "no threads");
}

#ifdef __linux__
TEST_CASE("who limits the memory gets an exception where there is no more") {
  if (!examples::free_memory()) return;
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const std::uint64_t free = *examples::free_memory();
    examples::limit_memory();
    constexpr std::size_t piece = std::size_t{64} << 20U;
    std::vector<char*> pieces;  // never touched: they take no memory
    int code = 1;
    try {
      for (std::uint64_t taken = 0; taken < free; taken += piece) pieces.push_back(new char[piece]);
    } catch (const std::bad_alloc&) {
      code = pieces.size() * piece > free / 2 ? 0 : 2;
    }
    ::_exit(code);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
}
#endif
