// SPDX-License-Identifier: BSD-3-Clause
//
// Determines the free memory, so that a program that needs more ends with a message instead of stalling the machine.
#pragma once

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <exception>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#ifdef __linux__
#include <sys/resource.h>
#include <unistd.h>
#endif

#include <orbis/core/file.hpp>

namespace examples {

/// The integer after the first `label` in `text`; nullopt if there is none. Saturates at the largest value.
[[nodiscard]] inline std::optional<std::uint64_t> number_after(std::string_view text, std::string_view label) {
  const std::size_t at = text.find(label);
  if (at == text.npos) return std::nullopt;
  text.remove_prefix(at + label.size());
  text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error == std::errc::result_out_of_range) return ~std::uint64_t{0};
  if (error != std::errc{}) return std::nullopt;
  return number;
}

/// The contents of a control group's memory files; empty if there is no group.
struct memory_group {
  std::string limit;  ///< bytes, or "max" if there is no limit
  std::string use;    ///< bytes in use, including cached files
  std::string stat;   ///< named values, including those of cached files
};

/// Free memory in bytes, from the text of /proc/meminfo and a control group; nullopt if /proc/meminfo does not state
/// it.
[[nodiscard]] inline std::optional<std::uint64_t> free_memory(std::string_view meminfo, const memory_group& group) {
  const auto available = number_after(meminfo, "MemAvailable:");  // kB
  if (!available) return std::nullopt;
  const std::uint64_t bytes = *available * 1024;
  const auto limit = number_after(group.limit, "");
  if (!limit) return bytes;
  const std::string stat = "\n" + group.stat;
  const std::uint64_t used = number_after(group.use, "").value_or(0);
  const std::uint64_t files = number_after(stat, "\ninactive_file ").value_or(0) +  // released under memory pressure
                              number_after(stat, "\nactive_file ").value_or(0);
  const std::uint64_t taken = used - std::min(used, files);
  return std::min(bytes, *limit - std::min(*limit, taken));
}

/// Free memory of this system in bytes, limited by the control group of a container.
[[nodiscard]] inline std::optional<std::uint64_t> free_memory() {
  const auto text = [](const std::string& path) { return orbis::read_file(path, 65536).value_or(std::string{}); };
  const std::string folder = "/sys/fs/cgroup/";
  memory_group group{text(folder + "memory.max"), text(folder + "memory.current"), text(folder + "memory.stat")};
  if (group.limit.empty()) {  // cgroup version 1
    const std::string first = folder + "memory/memory.";
    group = {text(first + "limit_in_bytes"), text(first + "usage_in_bytes"), text(first + "stat")};
  }
  return free_memory(text("/proc/meminfo"), group);
}

/// Limits the memory of this process to 90 % of the free memory: allocations beyond it throw std::bad_alloc, before the
/// machine swaps or kills other programs. No effect if the system does not report free memory or has no such limit.
inline void limit_memory() {
#ifdef __linux__
  const auto bytes = free_memory();
  const auto pages = orbis::read_file("/proc/self/statm", 4096);
  rlimit limit{};
  if (!bytes || !pages || ::getrlimit(RLIMIT_DATA, &limit) != 0) return;
  // The sixth of the seven numbers is the data size in pages.
  std::string_view rest = *pages;
  for (int n = 0; n != 5; ++n) rest.remove_prefix(std::min(rest.find(' '), rest.size() - 1) + 1);
  const auto page = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  const std::uint64_t most = number_after(rest, "").value_or(0) * page + *bytes / 10 * 9;
  if (limit.rlim_cur != RLIM_INFINITY && limit.rlim_cur <= most) return;
  limit.rlim_cur = limit.rlim_max == RLIM_INFINITY ? most : std::min<rlim_t>(most, limit.rlim_max);
  ::setrlimit(RLIMIT_DATA, &limit);
#endif
}

/// The error message for a program that ends with the exception `e`.
[[nodiscard]] inline std::string describe_exception(const std::exception& e) {
  if (dynamic_cast<const std::bad_alloc*>(&e) != nullptr) return "out of memory";
  const auto* const system = dynamic_cast<const std::system_error*>(&e);
  const bool no_thread = system != nullptr && system->code() == std::errc::resource_unavailable_try_again;
  return no_thread ? "no thread can be started: " + std::string{e.what()} : e.what();
}

}  // namespace examples
