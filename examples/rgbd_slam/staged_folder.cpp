// SPDX-License-Identifier: BSD-3-Clause
#include "staged_folder.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <ostream>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <orbis/core/file.hpp>

namespace app {

namespace fs = std::filesystem;
using orbis::result;

descriptor::descriptor(descriptor&& other) noexcept : number_{std::exchange(other.number_, -1)} {}
descriptor& descriptor::operator=(descriptor&& other) noexcept {
  std::swap(number_, other.number_);
  return *this;
}
descriptor::~descriptor() {
  if (number_ >= 0) ::close(number_);
}

namespace {

constexpr std::string_view prefix = ".rgbd_slam-", ready = ".ready", backup = "old", list = ".names";

auto failure(const fs::path& path, const std::string& what) {
  return orbis::fail(orbis::errc::write_failed, path.string(), what);
}
std::string reason(int code) { return std::generic_category().message(code); }

descriptor open_folder(const fs::path& folder) {
  return descriptor{::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
}

/// Locks a folder during its lifetime. No effect on file systems without locks.
class folder_lock {
 public:
  explicit folder_lock(int folder) : folder_{folder} {
    while (::flock(folder_, LOCK_EX) != 0 && errno == EINTR) {
    }
  }
  ~folder_lock() { ::flock(folder_, LOCK_UN); }
  folder_lock(const folder_lock&) = delete;
  folder_lock& operator=(const folder_lock&) = delete;

 private:
  int folder_;
};

/// A file to move into place. Strings, because a child process must not allocate memory.
struct move {
  std::string from, to, old;
  bool replaces = false;  ///< a file exists at `to`
  bool has_old = false;   ///< it also exists at `old`
};

/// Moves all files into place, or none; returns 0 or an errno value. Makes system calls only.
int rename_all(const std::vector<move>& moves) {
  for (std::size_t i = 0; i != moves.size(); ++i) {
    const move& next = moves[i];
    const bool is_there = ::access(next.from.c_str(), F_OK) == 0;
    // Without a hard link to it, the old file is moved aside.
    if (next.replaces && !next.has_old && is_there) ::rename(next.to.c_str(), next.old.c_str());
    if (::rename(next.from.c_str(), next.to.c_str()) == 0) continue;
    const int why = errno;
    if (why == ENOENT && !is_there && ::access(next.to.c_str(), F_OK) == 0)
      continue;  // done by a child process that was killed
    for (std::size_t done = i + 1; done-- != 0;)
      if (const move& m = moves[done]; m.replaces)
        ::rename(m.old.c_str(), m.to.c_str());
      else if (done != i)
        ::rename(m.to.c_str(), m.from.c_str());
    return why;
  }
  return 0;
}
/// Runs `rename_all` in a child process, which signals to this process or its end do not affect.
int rename_all_in_child(const std::vector<move>& moves) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  const pid_t child = ::fork();
  if (child == 0) {
    ::setsid();
    ::_exit(rename_all(moves));
  }
  int status = 0;
  bool finished = child > 0;
  if (child > 0)
    while (::waitpid(child, &status, 0) < 0 && finished) finished = errno == EINTR;
  const int why = !finished || !WIFEXITED(status) ? rename_all(moves) : WEXITSTATUS(status);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return why;
}

bool may_be_replaced(const fs::path& path) {
  std::error_code ignored;
  const fs::file_status there = fs::symlink_status(path, ignored);
  return !fs::exists(there) || fs::is_regular_file(there) || fs::is_symlink(there);
}

/// The moves of those files in `from` that have one of the names.
std::vector<move> moves_to(const fs::path& folder, const fs::path& from, const std::vector<std::string>& names) {
  std::vector<move> moves;
  for (const std::string& name : names) {
    std::error_code ignored;
    if (!fs::is_regular_file(fs::symlink_status(from / name, ignored))) continue;
    const fs::path to = folder / name, old = from / backup / name;
    moves.push_back({(from / name).string(), to.string(), old.string(), fs::exists(fs::symlink_status(to, ignored))});
  }
  return moves;
}

/// The names of the files that a hidden folder moves into place, each with a zero byte after it.
std::vector<std::string> listed_in(const fs::path& hidden) {
  std::string text = orbis::read_file(hidden / list).value_or(std::string{});
  std::vector<std::string> names;
  for (std::size_t end = 0; (end = text.find('\0')) != std::string::npos; text.erase(0, end + 1)) {
    const fs::path name = text.substr(0, end);
    if (!name.empty() && name == name.filename()) names.push_back(name.string());
  }
  return names;
}

/// Finishes or removes the hidden folders of ended processes in `folder`. @pre it is locked
void clear_leftovers(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code ec;
  for (fs::directory_iterator it{folder, ec}, end; !ec && it != end; it.increment(ec))
    if (it->path().filename().string().starts_with(prefix) && it->symlink_status(ec).type() == fs::file_type::directory)
      found.push_back(it->path());
  for (const fs::path& left : found) {
    const descriptor lock = open_folder(left);
    if (lock.get() < 0 || ::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) continue;  // of a running process
    if (left.filename().string().ends_with(ready) && rename_all(moves_to(folder, left, listed_in(left))) != 0) continue;
    fs::remove_all(left, ec);
  }
}

}  // namespace

void staged_folder::finish(const fs::path& folder) {
  const descriptor opened = open_folder(folder);
  if (opened.get() < 0) return;
  const folder_lock lock{opened.get()};
  clear_leftovers(folder);
}

result<staged_folder> staged_folder::open(const fs::path& folder, std::vector<std::string> names,
                                          hidden_folders& hidden) {
  std::error_code ec;
  fs::create_directories(folder, ec);
  if (ec) return failure(folder, "cannot be created: " + ec.message());
  staged_folder made;
  made.folder_ = fs::absolute(folder, ec);
  made.names_ = std::move(names);
  made.folder_lock_ = open_folder(made.folder_);
  if (made.folder_lock_.get() < 0) return failure(folder, "cannot be opened: " + reason(errno));
  for (const std::string& name : made.names_)
    if (!may_be_replaced(made.folder_ / name))
      return failure(folder / name, "is not a regular file and is not replaced");

  const folder_lock lock{made.folder_lock_.get()};
  clear_leftovers(made.folder_);
  std::string name = (made.folder_ / (std::string{prefix} + "XXXXXX")).string();
  const std::lock_guard registers{hidden.mutex};
  hidden.paths.emplace_back();
  if (::mkdtemp(name.data()) == nullptr) return failure(folder, "cannot create files in it: " + reason(errno));
  made.staging_ = hidden.paths.back() = name;
  made.staging_lock_ = open_folder(made.staging_);
  ::flock(made.staging_lock_.get(), LOCK_EX);
  return made;
}

std::vector<std::string> staged_folder::made() const {
  std::vector<std::string> found;
  std::error_code ignored;
  for (const std::string& name : names_)
    if (fs::is_regular_file(fs::symlink_status(staging_ / name, ignored))) found.push_back(name);
  return found;
}

void staged_folder::discard() noexcept {
  std::error_code ignored;
  if (!staging_.empty()) fs::remove_all(staging_, ignored);
  staging_.clear();
}

result<void> staged_folder::put_in_place(std::span<staged_folder* const> folders, hidden_folders& hidden) {
  // In the order of their inode numbers, so that two programs never deadlock.
  std::vector<staged_folder*> ordered(folders.begin(), folders.end());
  const auto number = [](const staged_folder* f) {
    struct stat status {};
    ::fstat(f->folder_lock_.get(), &status);
    return std::pair{status.st_dev, status.st_ino};
  };
  std::sort(ordered.begin(), ordered.end(), [&](const auto* a, const auto* b) { return number(a) < number(b); });
  std::vector<std::unique_ptr<folder_lock>> locks;
  for (const staged_folder* f : ordered) locks.push_back(std::make_unique<folder_lock>(f->folder_lock_.get()));

  const std::lock_guard stays{hidden.mutex};
  std::error_code ec;
  std::vector<move> moves;
  for (staged_folder* f : folders) {
    for (const std::string& name : f->made())
      if (!may_be_replaced(f->folder_ / name))
        return failure(f->folder_ / name, "is not a regular file and is not replaced");
    std::string names;
    for (const std::string& name : f->names_) (names += name) += '\0';
    if (auto listed = orbis::write_file_atomically(f->staging_ / list, [&](std::ostream& out) { out << names; });
        !listed)
      return listed;
    const fs::path marked = f->staging_.string() + std::string{ready};
    fs::create_directory(f->staging_ / backup, ec);
    ::fsync(f->staging_lock_.get());
    fs::rename(f->staging_, marked, ec);
    if (ec) return failure(f->folder_, "cannot move the new files into place: " + ec.message());
    std::replace(hidden.paths.begin(), hidden.paths.end(), f->staging_, marked);
    f->staging_ = marked;
    for (move& m : moves_to(f->folder_, marked, f->names_)) {
      m.has_old = m.replaces && ::link(m.to.c_str(), m.old.c_str()) == 0;
      moves.push_back(std::move(m));
    }
    ::fsync(f->folder_lock_.get());
  }
  const int why = rename_all_in_child(moves);
  if (why != 0) return failure(folders.front()->folder_, "cannot move the new files into place: " + reason(why));
  for (staged_folder* f : folders) {
    ::fsync(f->folder_lock_.get());
    f->discard();
  }
  return {};
}

}  // namespace app
