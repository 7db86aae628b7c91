// SPDX-License-Identifier: BSD-3-Clause
//
// Loaded before a program (LD_PRELOAD). After ORBIS_TEST_RENAMES files have been moved out of hidden folders, the
// program and its child processes are killed, or, with ORBIS_TEST_FAILS, one rename fails; with
// ORBIS_TEST_STAYS_BROKEN, all later ones as well. With ORBIS_TEST_NO_LINKS, there are no hard links. With
// ORBIS_TEST_KILLED_AFTER_ERROR, the program is killed when the failed move has been withdrawn. With
// ORBIS_TEST_OPTIONAL, after that many files of the map have been added to the other results, one fails.
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include <dlfcn.h>
#include <unistd.h>

namespace {

const pid_t program = getpid();
int renamed = 0;

bool is_set(const char* name) { return std::getenv(name) != nullptr; }

void kill_all() {
  if (getpid() != program) kill(program, SIGKILL);
  raise(SIGKILL);
}

}  // namespace

extern "C" int rename(const char* from, const char* to) {
  using function = int(const char*, const char*);
  static auto* const original = reinterpret_cast<function*>(dlsym(RTLD_NEXT, "rename"));
  const char* const allowed = std::getenv("ORBIS_TEST_RENAMES");
  const char* const hidden = std::strstr(from, "/.rgbd_slam-");
  const char* const name = hidden == nullptr ? nullptr : std::strchr(hidden + 1, '/');
  const std::size_t length = std::strlen(from);
  if (is_set("ORBIS_TEST_KILLED_AFTER_ERROR") && length > 6 && std::strcmp(from + length - 6, ".ready") == 0) {
    original(from, to);
    kill_all();
  }
  static int added = 0;
  const char* const optional = std::getenv("ORBIS_TEST_OPTIONAL");
  if (optional != nullptr && std::strstr(from, "/.rgbd_slam/optional/") != nullptr &&
      std::strstr(to, "/optional/") == nullptr && added++ == std::atoi(optional))
    return errno = EIO, -1;
  static bool is_broken = false;
  if (is_broken && is_set("ORBIS_TEST_STAYS_BROKEN")) return errno = EIO, -1;
  const bool moves =
      name != nullptr && std::strchr(name + 1, '/') == nullptr && std::strstr(to, "/.rgbd_slam-") == nullptr;
  if (allowed == nullptr || !moves || renamed++ != std::atoi(allowed)) return original(from, to);
  if (!is_set("ORBIS_TEST_FAILS")) kill_all();
  is_broken = true;
  errno = EIO;
  return -1;
}

extern "C" int link(const char* from, const char* to) {
  using function = int(const char*, const char*);
  static auto* const original = reinterpret_cast<function*>(dlsym(RTLD_NEXT, "link"));
  if (!is_set("ORBIS_TEST_NO_LINKS")) return original(from, to);
  errno = EPERM;
  return -1;
}
