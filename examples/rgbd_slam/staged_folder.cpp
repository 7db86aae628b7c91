// SPDX-License-Identifier: BSD-3-Clause
#include "staged_folder.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <ostream>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <orbis/core/file.hpp>

#include "interrupts.hpp"

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

constexpr std::string_view prefix = ".rgbd_slam-", ready = ".ready";
// Each hidden folder contains the replaced files and a list of the files to move. The first hidden folder of a
// transaction also lists the others, which list the first one.
const fs::path own = staged_folder::private_name;
const fs::path backup = own / "replaced", names_list = own / "names", others_list = own / "others",
               first_list = own / "first", complete_list = own / "complete";
const std::array spare = {own / "spare_1", own / "spare_2", own / "spare_3"};

auto failure(const fs::path& path, const std::string& what) {
  return orbis::fail(orbis::errc::write_failed, path.string(), what);
}
std::string reason(int code) { return std::generic_category().message(code); }

descriptor open_folder(const fs::path& folder) {
  return descriptor{::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
}

/// The path of a link to an open folder. The link remains valid if the user renames the folder; it is broken on systems
/// without /proc.
fs::path link_to(const descriptor& folder) { return "/proc/self/fd/" + std::to_string(folder.get()); }

/// Reserves space on the disk for the lists in a hidden folder, so that they can be written after the results have
/// filled the disk. Returns 0 or an errno value.
int reserve_space(const fs::path& hidden) {
  for (const fs::path& name : spare) {
    const descriptor file{::open((hidden / name).c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600)};
    if (file.get() < 0) return errno;
    if (const int why = ::posix_fallocate(file.get(), 0, 4096); why == ENOSPC || why == EDQUOT || why == EFBIG)
      return why;
  }
  return 0;
}

/// Locks folders during its lifetime. No effect on file systems without locks.
///
/// Runs of this program hold these locks for a short time, but a suspended run or another program may hold them longer:
/// waits for at most 10 s, or for at most 1 s in total if the user interrupts the run.
class folder_locks {
 public:
  explicit folder_locks(std::vector<int> folders) : folders_{std::move(folders)} {
    // Lock each folder once, in the order of the inode numbers, so that two programs never deadlock.
    const auto number = [](int folder) {
      struct stat status {};
      ::fstat(folder, &status);
      return std::pair{status.st_dev, status.st_ino};
    };
    std::sort(folders_.begin(), folders_.end(), [&](int a, int b) { return number(a) < number(b); });
    const auto is_same = [&](int a, int b) { return number(a) == number(b); };
    folders_.erase(std::unique(folders_.begin(), folders_.end(), is_same), folders_.end());
    using namespace std::chrono_literals;
    const auto start = std::chrono::steady_clock::now();
    for (const int folder : folders_)
      while (::flock(folder, LOCK_EX | LOCK_NB) != 0 && (errno == EINTR || errno == EWOULDBLOCK)) {
        const auto waited = std::chrono::steady_clock::now() - start;
        is_complete_ = waited < (interrupts::stop_requested() ? 1s : 10s);
        if (!is_complete_) return;
        std::this_thread::sleep_for(2ms);
      }
  }
  ~folder_locks() {
    for (const int folder : folders_) ::flock(folder, LOCK_UN);
  }
  folder_locks(const folder_locks&) = delete;
  folder_locks& operator=(const folder_locks&) = delete;

  /// Returns false if another program still holds one of the locks.
  [[nodiscard]] bool is_complete() const noexcept { return is_complete_; }

 private:
  std::vector<int> folders_;
  bool is_complete_ = true;
};
constexpr const char* locked_by_another = "another program has locked the folder";

/// A file to move into place. Paths are strings, because a child process must not allocate memory.
struct move {
  std::string from, to, old;
  bool replaces = false;  ///< a file exists at `to`
  bool has_old = false;   ///< `old` is a hard link to that file
};

/// Added to the errno value if the files that were already moved cannot be moved back.
constexpr int not_restored = 128;

/// Moves all files into place, or none; returns 0 or an errno value (see `not_restored`). Makes system calls only. Each
/// new file exists at every moment, so that any program can complete the moves.
int rename_all(const std::vector<move>& moves) {
  const auto exists = [](const std::string& path) {
    return ::faccessat(AT_FDCWD, path.c_str(), F_OK, AT_SYMLINK_NOFOLLOW) == 0;
  };
  const auto is_folder = [](const std::string& path) {
    struct stat status {};
    return ::lstat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode);
  };
  const auto rename = [](const std::string& from, const std::string& to) {
    return ::rename(from.c_str(), to.c_str()) == 0;
  };
  for (std::size_t i = 0; i != moves.size(); ++i) {
    const move& next = moves[i];
    if (!exists(next.from) && exists(next.to)) continue;  // done by a child process that was killed
    // If there is no hard link to the old file, it is moved aside. A folder is not: the rename then fails.
    const bool moves_aside = next.replaces && !next.has_old && exists(next.to) && !is_folder(next.to);
    if ((!moves_aside || rename(next.to, next.old)) && rename(next.from, next.to)) continue;
    const int why = errno < not_restored ? errno : EIO;
    for (std::size_t done = i + 1; done-- != 0;) {
      const move& m = moves[done];
      const bool is_back = done == i || rename(m.to, m.from);
      if (!is_back || (m.replaces && !exists(m.to) && !rename(m.old, m.to))) return not_restored + why;
    }
    return why;
  }
  return 0;
}
/// Runs `rename_all` in a child process, which is not affected by signals to this process or by its end.
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

/// The moves of the files in `from` that have one of the names.
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

/// Writes a list of texts, each with a zero byte after it.
result<void> write_list(const fs::path& path, const std::vector<std::string>& texts) {
  return orbis::write_file_atomically(path, [&](std::ostream& out) {
    for (const std::string& text : texts) out << text << '\0';
  });
}
/// Reads a list that `write_list` wrote. Empty if the file does not exist; nullopt if it cannot be read.
std::optional<std::vector<std::string>> read_list(const fs::path& path) {
  auto read = orbis::read_file(path);
  if (!read && read.error().code != orbis::errc::not_found) return std::nullopt;
  std::string text = std::move(read).value_or(std::string{});
  std::vector<std::string> texts;
  for (std::size_t end = 0; (end = text.find('\0')) != std::string::npos; text.erase(0, end + 1))
    texts.push_back(text.substr(0, end));
  return texts;
}

/// Returns true if `path` is a hidden folder of this program. A folder of another user, for example in /tmp, does not
/// count unless the parent folder belongs to the same user.
bool is_hidden_folder(const fs::path& path) {
  struct stat status {};
  struct stat parent {};
  if (!path.filename().string().starts_with(prefix) || ::lstat(path.c_str(), &status) != 0 || !S_ISDIR(status.st_mode))
    return false;
  return status.st_uid == ::geteuid() ||
         (::stat(path.parent_path().c_str(), &parent) == 0 && status.st_uid == parent.st_uid);
}
bool is_ready(const fs::path& hidden) { return hidden.filename().string().ends_with(ready); }

/// The first hidden folder of the transaction to which a hidden folder belongs; empty if the transaction has not begun,
/// nullopt if it cannot be determined: the first folder is missing (renamed, or on a disk that is not mounted).
std::optional<fs::path> first_of(const fs::path& hidden) {
  if (is_ready(hidden)) return hidden;
  const auto first = read_list(hidden / first_list);
  if (!first) return std::nullopt;
  if (first->size() != 1) return fs::path{};
  const fs::path marked = first->front();
  if (is_ready(marked) && is_hidden_folder(marked)) return marked;
  if (is_hidden_folder(fs::path{marked}.replace_extension())) return fs::path{};
  return std::nullopt;
}
/// Returns true if a hidden folder belongs to the transaction whose first one has the file name `first`. Names are
/// unique; the path may differ, as the user may have renamed a folder.
bool belongs_to(const fs::path& hidden, const fs::path& first) {
  const auto listed = read_list(hidden / first_list);
  return is_hidden_folder(hidden) && listed && listed->size() == 1 && fs::path{listed->front()}.filename() == first;
}
/// The other hidden folders of a transaction; nullopt if one of them is missing or cannot be read. @pre the transaction
/// is not complete
std::optional<std::vector<fs::path>> others_of(const fs::path& first) {
  const auto listed = read_list(first / others_list);
  if (!listed) return std::nullopt;
  std::vector<fs::path> others{listed->begin(), listed->end()};
  for (const fs::path& path : others)
    if (!belongs_to(path, first.filename())) return std::nullopt;
  return others;
}

std::vector<fs::path> hidden_folders_in(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code ec;
  for (fs::directory_iterator it{folder, ec}, end; !ec && it != end; it.increment(ec))
    if (is_hidden_folder(it->path())) found.push_back(it->path());
  return found;
}
/// Returns true if the process that created a hidden folder has ended, or may not be examined and has complete results.
bool is_left(const fs::path& hidden) {
  const descriptor lock = open_folder(hidden);
  if (lock.get() < 0) return errno == EACCES && is_ready(hidden);
  return ::flock(lock.get(), LOCK_EX | LOCK_NB) == 0;
}
/// The time at which the results in a hidden folder were complete; the earliest time if they never were.
fs::file_time_type completion_time(const fs::path& hidden) {
  std::error_code no_list;
  const fs::file_time_type time = fs::last_write_time(hidden / names_list, no_list);
  return no_list ? fs::file_time_type::min() : time;
}

void sync_folder(const fs::path& folder) {
  if (const descriptor opened = open_folder(folder); opened.get() >= 0) ::fsync(opened.get());
}

/// Removes the hidden folders of a transaction that is complete or has not begun. `list`: the list of the others in
/// `first`. Keeps `first` while one of the others is missing or still in use, so that it is known to belong to it.
void remove_hidden(const fs::path& first, const fs::path& list) {
  std::string marked = first.filename().string();
  if (!is_ready(first)) marked += ready;
  std::error_code ignored;
  bool are_gone = true;
  for (const fs::path path : read_list(first / list).value_or(std::vector<std::string>{})) {
    if (belongs_to(path, marked) && is_left(path)) fs::remove_all(path, ignored);
    are_gone &= !is_hidden_folder(path) && fs::is_directory(path.parent_path(), ignored);
  }
  if (are_gone) fs::remove_all(first, ignored);
}
/// Marks a transaction as complete: all files have been moved, and their folders synced.
void mark_complete(const fs::path& first) {
  std::error_code ignored;
  fs::rename(first / others_list, first / complete_list, ignored);
  sync_folder(first / own);
}
bool is_complete(const fs::path& first) {
  std::error_code ignored;
  return fs::exists(fs::symlink_status(first / complete_list, ignored));
}

/// Completes the transaction whose first hidden folder is `first`. Returns the reason if that is not possible now.
/// @pre the folders of all its files are locked
std::optional<std::string> finish_transaction(const fs::path& first) {
  if (!is_complete(first)) {
    auto folders = others_of(first);
    if (!folders) return "a folder of their files is missing or cannot be read";
    folders->push_back(first);
    std::vector<move> moves;
    for (const fs::path& hidden : *folders) {
      auto names = read_list(hidden / names_list);
      if (!names) return "their list cannot be read";
      std::error_code ignored;
      fs::create_directories(hidden / backup, ignored);  // usually exists
      std::erase_if(*names, [](const fs::path& name) { return name.empty() || name != name.filename(); });
      for (move& m : moves_to(hidden.parent_path(), hidden, *names)) {
        if (!may_be_replaced(m.to)) return fs::path{m.to}.filename().string() + " is not a regular file";
        moves.push_back(std::move(m));
      }
    }
    if (const int why = rename_all(moves); why != 0) return reason(why % not_restored);
    for (const fs::path& hidden : *folders) sync_folder(hidden.parent_path());
    mark_complete(first);
  }
  remove_hidden(first, complete_list);
  return std::nullopt;
}

/// Returns true if all files of a hidden folder have been moved.
bool is_emptied(const fs::path& hidden) {
  const auto names = read_list(hidden / names_list);
  return names && !names->empty() && moves_to(hidden.parent_path(), hidden, *names).empty();
}

struct opened_folder {
  fs::path path;
  int number = -1;
};

/// Locked folders in which all results of earlier runs have been moved into place.
struct cleared_folders {
  std::vector<descriptor> descriptors;
  std::unique_ptr<folder_locks> locks;
  std::string obstacle;  ///< the reason why the folders could not be locked or cleared; empty if there is none
};

/// Locks `folders`, completes the transactions that ended processes left in them, and removes the hidden folders of
/// these processes. Also locks the folders of the other files of these transactions. All folders are locked together:
/// locking starts again whenever a folder is found that is not locked yet. `ours`: hidden folders of this process.
cleared_folders lock_and_clear(const std::vector<opened_folder>& folders, const std::vector<fs::path>& ours = {}) {
  cleared_folders cleared;
  std::vector<fs::path> paths;
  std::vector<int> numbers;
  for (const opened_folder& folder : folders) {
    paths.push_back(folder.path);
    numbers.push_back(folder.number);
  }
  const auto add = [&](const fs::path& path) {
    if (std::find(paths.begin(), paths.end(), path) != paths.end()) return;
    paths.push_back(path);
    cleared.descriptors.push_back(open_folder(path));
    const int number = cleared.descriptors.back().get();
    if (number >= 0)
      numbers.push_back(number);
    else
      cleared.obstacle = path.string() + ", which contains results of an earlier run, cannot be opened";
  };
  const auto add_parents = [&](const fs::path& first, const fs::path& list) {
    for (const fs::path other : read_list(first / list).value_or(std::vector<std::string>{}))
      if (is_hidden_folder(other)) add(other.parent_path());
  };
  std::vector<std::pair<fs::file_time_type, fs::path>> leftovers;
  for (std::size_t locked = 0; locked != paths.size();) {
    locked = paths.size();
    leftovers.clear();
    cleared.locks.reset();
    cleared.locks = std::make_unique<folder_locks>(numbers);
    if (!cleared.locks->is_complete()) {
      cleared.obstacle = locked_by_another;
      return cleared;
    }
    for (std::size_t i = 0; i != locked; ++i)
      for (const fs::path& left : hidden_folders_in(paths[i])) {
        if (std::find(ours.begin(), ours.end(), left) != ours.end() || !is_left(left)) continue;
        leftovers.emplace_back(completion_time(left), left);
        const auto first = first_of(left);
        if (!first) continue;
        if (!first->empty()) add(first->parent_path());
        for (const fs::path& list : {others_list, complete_list}) add_parents(first->empty() ? left : *first, list);
      }
    if (!cleared.obstacle.empty()) return cleared;
  }
  std::sort(leftovers.begin(), leftovers.end());
  for (const auto& [time, left] : leftovers) {
    if (!is_hidden_folder(left)) continue;  // finished together with another one
    const auto first = first_of(left);
    std::optional<std::string> why;
    if (first && first->empty()) remove_hidden(left, others_list);
    if (first && !first->empty()) why = finish_transaction(*first);
    // Its first folder may be among the others under another path, and is then finished in its turn.
    const bool has_first = std::any_of(leftovers.begin(), leftovers.end(), [&, of = &left](const auto& other) {
      return is_ready(other.second) && belongs_to(*of, other.second.filename());
    });
    if (!first && !has_first && !is_emptied(left)) why = "the folder of their other files is missing or cannot be read";
    if (why) {  // later results must not be moved into place before earlier ones
      cleared.obstacle = "the results of an earlier run, in the hidden folder " + left.filename().string() +
                         ", cannot be moved into place: " + *why + "; delete that folder if you do not need them";
      break;
    }
  }
  return cleared;
}

}  // namespace

result<void> staged_folder::finish(const fs::path& folder) {
  std::error_code ignored;
  const fs::path whole = fs::canonical(folder, ignored);
  if (hidden_folders_in(whole).empty()) return {};  // without waiting for the lock
  const descriptor opened = open_folder(whole);
  if (opened.get() < 0) return {};  // nothing can be read in it
  if (const auto cleared = lock_and_clear({{whole, opened.get()}}); !cleared.obstacle.empty())
    return failure(folder, cleared.obstacle);
  return {};
}

result<staged_folder> staged_folder::open(const fs::path& folder, std::vector<std::string> names,
                                          hidden_folders& hidden) {
  std::error_code ec;
  fs::create_directories(folder, ec);
  if (ec) return failure(folder, "cannot be created: " + ec.message());
  staged_folder made;
  made.folder_ = fs::canonical(folder, ec);
  made.names_ = std::move(names);
  made.folder_lock_ = open_folder(made.folder_);
  if (made.folder_lock_.get() < 0) return failure(folder, "cannot be opened: " + reason(errno));
  for (const std::string& name : made.names_)
    if (!may_be_replaced(made.folder_ / name))
      return failure(folder / name, "is not a regular file and will not be replaced");

  const auto cleared = lock_and_clear({{made.folder_, made.folder_lock_.get()}});
  if (!cleared.obstacle.empty()) return failure(folder, cleared.obstacle);
  std::string name = (made.folder_ / (std::string{prefix} + "XXXXXX")).string();
  const std::lock_guard registers{hidden.mutex};
  hidden.paths.emplace_back();
  if (::mkdtemp(name.data()) == nullptr) return failure(folder, "cannot create files in it: " + reason(errno));
  made.staging_ = hidden.paths.back() = name;
  made.staging_lock_ = open_folder(made.staging_);
  if (made.staging_lock_.get() < 0) {
    const int why = errno;
    fs::remove(made.staging_, ec);
    return failure(folder, "cannot create files in it: " + reason(why));
  }
  ::flock(made.staging_lock_.get(), LOCK_EX);
  for (const fs::path& part : {own, backup})
    if (!ec) fs::create_directory(made.staging_ / part, ec);
  if (const int why = ec ? ec.value() : reserve_space(made.staging_); why != 0)
    return failure(folder, "cannot create files in it: " + reason(why));
  return made;
}

fs::path staged_folder::path() const {
  std::error_code ignored;
  const fs::path link = link_to(staging_lock_);
  return fs::is_directory(link, ignored) ? link : staging_;
}

std::vector<std::string> staged_folder::made() const {
  std::vector<std::string> found;
  std::error_code ignored;
  for (const std::string& name : names_)
    if (fs::is_regular_file(fs::symlink_status(staging_ / name, ignored))) found.push_back(name);
  return found;
}

void staged_folder::follow(hidden_folders& hidden) {
  std::error_code ec;
  const fs::path present = fs::read_symlink(link_to(staging_lock_), ec);
  if (ec || !fs::is_directory(present, ec)) return;
  std::replace(hidden.paths.begin(), hidden.paths.end(), staging_, present);
  staging_ = present;
  folder_ = present.parent_path();
}

void staged_folder::discard() noexcept {
  staging_lock_ = {};  // all descriptors may be in use, and removal needs one
  std::error_code ignored;
  if (!staging_.empty()) fs::remove_all(staging_, ignored);
  staging_.clear();
}

std::error_code staged_folder::rename_hidden(const fs::path& to, hidden_folders& hidden) {
  std::error_code failure;
  fs::rename(staging_, to, failure);
  if (failure) return failure;
  std::replace(hidden.paths.begin(), hidden.paths.end(), staging_, to);
  staging_ = to;
  ::fsync(folder_lock_.get());
  return {};
}

void staged_folder::leave(hidden_folders& hidden) {
  std::erase(hidden.paths, staging_);
  staging_.clear();
  staging_lock_ = {};
}

result<void> staged_folder::put_in_place(std::span<staged_folder* const> folders, hidden_folders& hidden,
                                         const std::function<void()>& complete) {
  {
    const std::lock_guard registers{hidden.mutex};
    for (staged_folder* f : folders) f->follow(hidden);
  }
  staged_folder& first = *folders.front();
  const fs::path marked = first.staging_.string() + std::string{ready};

  // Prepare all folders.
  std::error_code ec;
  const auto prepare = [&](staged_folder& f, const fs::path& list, const std::vector<std::string>& texts) {
    for (const fs::path& name : spare) fs::remove(f.staging_ / name, ec);
    auto listed = write_list(f.staging_ / names_list, f.names_);
    if (listed) listed = write_list(f.staging_ / list, texts);
    if (!listed) return result<void>{failure(f.folder_, "the list of new files " + listed.error().message)};
    ::fsync(f.staging_lock_.get());
    ::fsync(f.folder_lock_.get());
    return listed;
  };
  std::vector<staged_folder*> prepared{&first};
  std::vector<std::string> others;
  std::optional<orbis::error> left_out;
  for (staged_folder* f : folders.subspan(1)) {
    if (auto done = prepare(*f, first_list, {marked.string()}); done) {
      prepared.push_back(f);
      others.push_back(f->staging_.string());
    } else {
      left_out = done.error();
      left_out->message += "; the other results were written";
      f->discard();
    }
  }
  if (auto done = prepare(first, others_list, others); !done) return done;
  // The results of earlier runs are moved into place first.
  std::vector<opened_folder> opened;
  std::vector<fs::path> ours;
  for (const staged_folder* f : prepared) {
    opened.push_back({f->folder_, f->folder_lock_.get()});
    ours.push_back(f->staging_);
  }
  const auto cleared = lock_and_clear(opened, ours);
  const std::lock_guard stays{hidden.mutex};
  for (const staged_folder* f : prepared)
    for (const std::string& name : f->made())
      if (!may_be_replaced(f->folder_ / name))
        return failure(f->folder_ / name, "is not a regular file and will not be replaced");
  if (cleared.obstacle.empty()) complete();
  // From here on, any program can complete the transaction.
  const fs::path unmarked = first.staging_;
  if (const std::error_code why = first.rename_hidden(marked, hidden))
    return failure(first.folder_, "cannot move the new files into place: " + why.message());
  const auto postponed = [&](const std::string& what) {
    auto failed =
        failure(first.folder_, what + "; the next command that uses the folder moves the new files into place");
    for (staged_folder* f : prepared) f->leave(hidden);
    return failed;
  };
  if (!cleared.obstacle.empty()) return postponed(cleared.obstacle);

  std::vector<move> moves;
  for (const staged_folder* f : prepared)
    for (move& m : moves_to(f->folder_, f->staging_, f->names_)) {
      m.has_old = m.replaces && ::link(m.to.c_str(), m.old.c_str()) == 0;
      moves.push_back(std::move(m));
    }
  const int why = rename_all_in_child(moves);
  if (why >= not_restored) return postponed("cannot move the new files into place: " + reason(why - not_restored));
  if (why != 0) {
    const std::string what = "cannot move the new files into place: " + reason(why);
    if (first.rename_hidden(unmarked, hidden)) return postponed(what);
    return failure(first.folder_, what);  // no program completes this transaction
  }
  for (const staged_folder* f : prepared) ::fsync(f->folder_lock_.get());
  mark_complete(first.staging_);
  std::for_each(prepared.rbegin(), prepared.rend(), [](staged_folder* f) { f->discard(); });
  if (left_out) return orbis::fail(*left_out);
  return {};
}

}  // namespace app
