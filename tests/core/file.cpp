// SPDX-License-Identifier: BSD-3-Clause
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <ostream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#ifdef __linux__
#include <cstdio>

#include <sys/syscall.h>
#endif

#include <orbis/core/file.hpp>

#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

namespace fs = std::filesystem;
using namespace orbis;

namespace {

struct scratch_folder : test::temporary_folder {
  [[nodiscard]] std::ptrdiff_t files() const {
    return std::distance(fs::directory_iterator{path()}, fs::directory_iterator{});
  }
};

result<void> write_text(const fs::path& path, const std::string& text) {
  return write_file_atomically(path, [&](std::ostream& out) { out << text; });
}

#ifdef __linux__
/// What this program asked of the system, in that order, while somebody listens.
struct disk_call {
  enum class kind { sync_file, sync_folder, rename } what;
  ::ino_t file;
  ::off_t bytes;  ///< in the file at that time
};
std::vector<disk_call>* disk_calls = nullptr;
bool has_proc = true;  ///< false: as on a system on which /proc is not mounted
#endif

}  // namespace

#ifdef __linux__
// In place of those of the C library, for this program and for the C++ library.
extern "C" int fsync(int file) {
  if (struct stat state{}; disk_calls != nullptr && ::fstat(file, &state) == 0)
    disk_calls->push_back({S_ISDIR(state.st_mode) ? disk_call::kind::sync_folder : disk_call::kind::sync_file,
                           state.st_ino, state.st_size});
  return static_cast<int>(::syscall(SYS_fsync, file));
}
extern "C" int rename(const char* from, const char* to) noexcept(noexcept(::rename(from, to))) {
  if (struct stat state{}; disk_calls != nullptr && ::stat(from, &state) == 0)
    disk_calls->push_back({disk_call::kind::rename, state.st_ino, state.st_size});
  return static_cast<int>(::syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}
extern "C" int access(const char* path, int mode) noexcept(noexcept(::access(path, mode))) {
  if (!has_proc && std::string{path}.starts_with("/proc/")) return errno = ENOENT, -1;
  return static_cast<int>(::syscall(SYS_faccessat, AT_FDCWD, path, mode));
}

TEST_CASE("without /proc a file has a hidden name until it is complete") {
  const scratch_folder folder;
  has_proc = false;
  std::vector<std::string> names;
  const auto written = write_file_atomically(folder / "file", [&](std::ostream& out) {
    out << "text";
    for (const fs::directory_entry& entry : fs::directory_iterator{folder.path()})
      names.push_back(entry.path().filename().string());
  });
  // An earlier process has left the names that come next.
  const std::string stem = ".orbis-" + std::to_string(::getpid()) + "-";
  constexpr unsigned long left = 80;
  unsigned long next = 0;
  if (names.size() == 1 && names[0].starts_with(stem)) next = std::stoul(names[0].substr(stem.size())) + 1;
  for (unsigned long i = next; i != next + left; ++i)
    std::ofstream{folder / (stem + std::to_string(i) + ".part")} << "left";
  const auto again = write_text(folder / "file", "new");
  const auto failed = write_file_atomically(
      folder / "file", [](std::ostream&) -> result<void> { return fail(errc::write_failed, "", "cannot"); });
  has_proc = true;
  REQUIRE(written);
  REQUIRE(names.size() == 1);
  CHECK(names[0] == stem + std::to_string(next - 1) + ".part");
  CHECK(again);
  CHECK_FALSE(failed);
  CHECK(read_file(folder / "file").value() == "new");
  CHECK(folder.files() == left + 1);
}

TEST_CASE("a file is whole on the disk before it gets its name, and then its name is") {
  const scratch_folder folder;
  const auto inode_of = [](const fs::path& path) {
    struct stat state {};
    REQUIRE(::stat(path.c_str(), &state) == 0);
    return state.st_ino;
  };
  const auto calls_of = [](const fs::path& path, const std::string& text) {
    std::vector<disk_call> calls;
    disk_calls = &calls;
    const auto written = write_text(path, text);
    disk_calls = nullptr;
    REQUIRE(written);
    return calls;
  };
  for (const std::size_t size : {std::size_t{10}, std::size_t{1} << 20U}) {  // buffered, and beyond the buffer
    const fs::path path = folder / "file";
    const std::vector<disk_call> calls = calls_of(path, std::string(size, 'x'));
    REQUIRE(calls.size() == 3);
    CHECK(calls[0].what == disk_call::kind::sync_file);
    CHECK(calls[0].file == inode_of(path));
    CHECK(calls[0].bytes == static_cast<::off_t>(size));
    CHECK(calls[1].what == disk_call::kind::rename);
    CHECK(calls[1].file == inode_of(path));
    CHECK(calls[2].what == disk_call::kind::sync_folder);
    CHECK(calls[2].file == inode_of(folder.path()));
  }
  // The folder of a name without one is the current one.
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());
  const std::vector<disk_call> calls = calls_of("bare", "text");
  fs::current_path(before);
  REQUIRE(calls.size() == 3);
  CHECK(calls[2].what == disk_call::kind::sync_folder);
  CHECK(calls[2].file == inode_of(folder.path()));
}
#endif

TEST_CASE("what was written is read again whatever the bytes") {
  const scratch_folder folder;
  std::string bytes;
  for (int i = 0; i != 200000; ++i) bytes += static_cast<char>(i * 7);
  for (const std::string& text : {std::string{}, std::string{"a\r\n\0b", 5}, bytes}) {
    REQUIRE(write_text(folder / "file", text));
    const auto again = read_file(folder / "file");
    REQUIRE(again);
    CHECK(*again == text);
    CHECK(folder.files() == 1);
  }
}

TEST_CASE("files that are not there or not readable are told apart") {
  const scratch_folder folder;
  const auto absent = read_file(folder / "absent");
  REQUIRE(!absent);
  CHECK(absent.error().code == errc::not_found);
  CHECK(absent.error().where == (folder / "absent").string());
  const auto directory = read_file(folder.path());
  REQUIRE(!directory);
  CHECK(directory.error().code == errc::unreadable);
  CHECK(read_file(std::string(5000, 'n')).error().code == errc::unreadable);  // longer than any name
  if (fs::exists("/proc/self/mem")) {  // opens, but its first page cannot be read
    const auto broken = read_file("/proc/self/mem");
    REQUIRE(!broken);
    CHECK(broken.error().code == errc::unreadable);
  }
  if (fs::exists("/proc/self/stat")) CHECK(!read_file("/proc/self/stat").value().empty());  // says it has size 0
}

TEST_CASE("what is no regular file is not read and nobody waits for it") {
  const scratch_folder folder;
  REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);
  fs::create_symlink("/dev/zero", folder / "zeros");
  for (const fs::path& path : {folder / "pipe", fs::path{"/dev/zero"}, folder / "zeros"}) {
    const auto read = read_file(path);
    REQUIRE(!read);
    CHECK(read.error().code == errc::unreadable);
    CHECK(read.error().to_string() == path.string() + ": is not a regular file");
  }
}

TEST_CASE("a file beyond the limit is refused before it is read") {
  const scratch_folder folder;
  REQUIRE(write_text(folder / "ten", "0123456789"));
  CHECK(read_file(folder / "ten", 10).value() == "0123456789");
  CHECK(read_file(folder / "ten", 9).error().code == errc::malformed);
  CHECK(read_file(folder / "ten", 9).error().message == "is larger than 9 bytes, the limit for such files");
  std::ofstream{folder / "holes"};
  fs::resize_file(folder / "holes", std::uintmax_t{1} << 40);  // takes no space
  CHECK(read_file(folder / "holes", 1 << 20).error().code == errc::malformed);
  if (fs::exists("/proc/self/stat")) CHECK(read_file("/proc/self/stat", 3).error().code == errc::malformed);
}

TEST_CASE("a writer that gives up or throws leaves the old file and nothing else") {
  const scratch_folder folder;
  const fs::path path = folder / "kept.txt";
  REQUIRE(write_text(path, "old"));

  const auto given_up = write_file_atomically(path, [](std::ostream& out) -> result<void> {
    out << "half of it";
    return fail(errc::cancelled, "writer", "was asked to stop");
  });
  REQUIRE(!given_up);
  CHECK(given_up.error().code == errc::cancelled);
  CHECK(read_file(path).value() == "old");
  CHECK(folder.files() == 1);

  CHECK_THROWS_AS((void)write_file_atomically(path,
                                              [](std::ostream& out) {
                                                out << "half of it";
                                                throw std::runtime_error{"no more"};
                                              }),
                  std::runtime_error);
  CHECK(read_file(path).value() == "old");
  CHECK(folder.files() == 1);

  const auto broken = write_file_atomically(path, [](std::ostream& out) { out.setstate(std::ios::badbit); });
  REQUIRE(!broken);
  CHECK(broken.error().code == errc::write_failed);
  CHECK(read_file(path).value() == "old");
  CHECK(folder.files() == 1);

  const auto good = write_file_atomically(path, [](std::ostream& out) -> result<void> {
    out << "new";
    return {};
  });
  CHECK(good);
  CHECK(read_file(path).value() == "new");
}

TEST_CASE("a file that finds no room is an error whether it shows in writing or in closing") {
  const scratch_folder folder;
  const fs::path path = folder / "map.bt";
  REQUIRE(write_text(path, "old"));
  rlimit before{};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  for (const std::size_t size : {std::size_t{10}, std::size_t{1} << 20U}) {  // buffered, and beyond the buffer
    const rlimit none{4, before.rlim_max};                                   // a file may have four bytes
    ::setrlimit(RLIMIT_FSIZE, &none);
    const auto full = write_text(path, std::string(size, 'x'));
    ::setrlimit(RLIMIT_FSIZE, &before);
    REQUIRE(!full);
    CHECK(full.error().code == errc::write_failed);
    CHECK(full.error().where == path.string());
    CHECK(full.error().message.find("File too large") != std::string::npos);
    CHECK(read_file(path).value() == "old");
    CHECK(folder.files() == 1);
  }
  std::signal(SIGXFSZ, handler);
}

TEST_CASE("threads that write the same file leave one of their files and nothing else") {
  const scratch_folder folder;
  const fs::path path = folder / "shared";
  std::atomic<int> failures{0};
  std::vector<std::thread> writers;
  for (char name = 'a'; name != 'e'; ++name)
    writers.emplace_back([&, name] {
      for (int i = 0; i != 20; ++i) failures += write_text(path, std::string(100000, name)) ? 0 : 1;
    });
  for (std::thread& writer : writers) writer.join();
  CHECK(failures == 0);
  const std::string left = read_file(path).value();
  CHECK(left == std::string(100000, left.at(0)));
  CHECK(folder.files() == 1);
}

TEST_CASE("processes that write the same file leave one of their files and nothing else") {
  const scratch_folder folder;
  const fs::path path = folder / "shared";
  const auto content = [](char name) { return std::string(name == 'a' ? 20000 : 30000, name); };
  REQUIRE(write_text(path, content('a')));
  std::vector<::pid_t> writers;
  for (const char name : {'a', 'b'}) {  // they begin with the same number of calls, and so do the names they make up
    const ::pid_t writer = ::fork();
    if (writer == 0) {
      int failures = 0;
      for (int i = 0; i != 200; ++i) failures += write_text(path, content(name)) ? 0 : 1;
      ::_exit(failures == 0 ? 0 : 1);
    }
    writers.push_back(writer);
  }
  int reads = 0, torn = 0, failed = 0;
  while (!writers.empty()) {
    const auto got = read_file(path);
    torn += got && (*got == content('a') || *got == content('b')) ? 0 : 1;
    ++reads;
    std::erase_if(writers, [&](::pid_t writer) {
      int status = 0;
      if (writer > 0 && ::waitpid(writer, &status, WNOHANG) == 0) return false;
      failed += writer > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0 ? 0 : 1;
      return true;
    });
  }
  CAPTURE(reads);
  CHECK(failed == 0);
  CHECK(torn == 0);
  CHECK(folder.files() == 1);
}

TEST_CASE("a temporary file that an ended process left does not stop the next one") {
  const scratch_folder folder;
  constexpr int names = 80;  // that this process would use next
  for (int i = 0; i != names; ++i)
    std::ofstream{folder / (".orbis-" + std::to_string(::getpid()) + "-" + std::to_string(i) + ".part")} << "left";
  CHECK(write_text(folder / "file", "text"));
  CHECK(read_file(folder / "file").value() == "text");
  CHECK(folder.files() == names + 1);
}

#ifdef O_TMPFILE
TEST_CASE("a writer that is killed leaves nothing") {
  const scratch_folder folder;
  const int probe = ::open(folder.path().c_str(), O_WRONLY | O_TMPFILE, 0600);
  if (probe < 0) {
    std::printf("[skipped] the file system has no files without names\n");
    return;
  }
  ::close(probe);
  REQUIRE(write_text(folder / "file", "old"));
  const ::pid_t writer = ::fork();
  if (writer == 0) {
    static_cast<void>(orbis::write_file_atomically(folder / "file", [](std::ostream& out) {
      out << "new" << std::flush;
      ::raise(SIGKILL);
    }));
    ::_exit(0);
  }
  int status = 0;
  REQUIRE(::waitpid(writer, &status, 0) == writer);
  CHECK(WIFSIGNALED(status));
  CHECK(read_file(folder / "file").value() == "old");
  CHECK(folder.files() == 1);
}
#endif

TEST_CASE("a device or a pipe is not replaced by a file") {
  const scratch_folder folder;
  const fs::path pipe = folder / "pipe";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  const auto r = write_text(pipe, "text");
  REQUIRE(!r);
  CHECK(r.error().code == errc::write_failed);
  CHECK(fs::is_fifo(pipe));
  CHECK(folder.files() == 1);
}

TEST_CASE("a file that cannot be created says so and names the file") {
  const scratch_folder folder;
  REQUIRE(write_text(folder / "plain", "x"));
  for (const fs::path& path : {folder / "absent" / "file", folder / "plain" / "file"}) {
    const auto r = write_text(path, "text");
    REQUIRE(!r);
    CHECK(r.error().code == errc::write_failed);
    CHECK(r.error().to_string().find(path.string()) == 0);
  }
  fs::create_directories(folder / "occupied" / "by");
  const auto r = write_text(folder / "occupied", "text");
  REQUIRE(!r);
  CHECK(r.error().code == errc::write_failed);
  CHECK(folder.files() == 2);
}
