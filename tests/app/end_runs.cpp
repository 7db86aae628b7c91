// SPDX-License-Identifier: BSD-3-Clause
//
// end_runs RGBD_SLAM FOLDER: ends runs of the program at many moments, by signals and by errors, over the results of an
// earlier run. Whatever happens, the files in the output folder are those of one run: all old, or all new.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <orbis/core/point_cloud.hpp>
#include <orbis/core/random.hpp>
#include <orbis/io/ply.hpp>

namespace fs = std::filesystem;
using clock_type = std::chrono::steady_clock;
using seconds = std::chrono::duration<double>;

namespace {

using folder_content = std::map<std::string, std::string>;  // bytes by name

std::string program;

[[noreturn]] void give_up(const std::string& what) {
  std::fprintf(stderr, "end_runs: %s\n", what.c_str());
  std::exit(1);
}
void check(bool holds, const std::string& what) {
  if (!holds) give_up(what);
}

/// The program on its way, without a word.
class run {
 public:
  explicit run(std::vector<std::string> arguments, rlim_t largest_file = RLIM_INFINITY) {
    arguments.insert(arguments.begin(), program);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    process_ = ::fork();
    if (process_ != 0) return;
    const int nowhere = ::open("/dev/null", O_WRONLY);
    ::dup2(nowhere, STDOUT_FILENO);
    ::dup2(nowhere, STDERR_FILENO);
    if (largest_file != RLIM_INFINITY) {
      const rlimit limit{largest_file, largest_file};
      ::setrlimit(RLIMIT_FSIZE, &limit);
      std::signal(SIGXFSZ, SIG_IGN);
    }
    ::execv(argv.front(), argv.data());
    ::_exit(127);
  }
  run(const run&) = delete;
  run& operator=(const run&) = delete;

  void send(int signal) const { ::kill(process_, signal); }
  /// How many files without a name it has open, whose name was `name`.
  [[nodiscard]] std::size_t nameless(const std::string& name) const {
    std::size_t count = 0;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator{"/proc/" + std::to_string(process_) + "/fd", ignored}) {
      const std::string target = fs::read_symlink(entry.path(), ignored).string();
      count += target.ends_with("/" + name + " (deleted)") ? 1U : 0U;
    }
    return count;
  }
  [[nodiscard]] bool is_over() { return over_ = over_ || ::waitpid(process_, &status_, WNOHANG) == process_; }
  /// Waits for the end; the exit code, or minus the signal.
  int wait() {
    if (!over_) ::waitpid(process_, &status_, 0);
    over_ = true;
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : -WTERMSIG(status_);
  }

 private:
  pid_t process_ = 0;
  int status_ = 0;
  bool over_ = false;
};

/// All regular files whose names are not hidden.
folder_content content_of(const fs::path& folder) {
  folder_content content;
  for (const auto& entry : fs::directory_iterator{folder}) {
    if (entry.path().filename().string().starts_with('.') || !entry.is_regular_file()) continue;
    std::ifstream in{entry.path(), std::ios::binary};
    content[entry.path().filename().string()] = {std::istreambuf_iterator<char>{in}, {}};
  }
  return content;
}

std::size_t hidden_in(const fs::path& folder) {
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator{folder})
    count += entry.path().filename().string().starts_with('.') ? 1U : 0U;
  return count;
}

void put_back(const fs::path& folder, const folder_content& content) {
  fs::remove_all(folder);
  fs::create_directories(folder);
  for (const auto& [name, bytes] : content) std::ofstream{folder / name, std::ios::binary} << bytes;
}

/// Files that say when they were made: no two runs write the same bytes.
bool is_dated(const std::string& name) { return name == "summary.json" || name == "report.html"; }

/// The same bytes in every run here.
constexpr std::string_view one_camera = "camera_used.toml";

/// Whether `now` is one of the two runs' files as a whole; neither: the test ends. `after` is not known where a run is
/// interrupted: then what is not old is new.
bool is_new(const folder_content& now, const folder_content& before, const folder_content* after,
            const std::string& moment) {
  std::size_t old_files = 0, new_files = 0;
  for (const auto& [name, bytes] : before) {
    const auto found = now.find(name);
    if (found == now.end()) give_up(moment + ": " + name + " is gone");
    if (found->second == bytes) {
      const bool tells = after != nullptr ? after->at(name) != bytes : name != one_camera;
      if (tells) ++old_files;
      continue;
    }
    ++new_files;
    if (name == "summary.json") check(bytes.ends_with("}\n"), moment + ": half of summary.json");
    if (name == "report.html") check(bytes.find("</html>") != std::string::npos, moment + ": half of report.html");
    if (after != nullptr && !is_dated(name))
      check(found->second == after->at(name), moment + ": " + name + " is neither the old file nor the new one");
  }
  check(now.size() == before.size(), moment + ": there is a file that neither run made");
  check(old_files == 0 || new_files == 0,
        moment + ": " + std::to_string(old_files) + " old files beside " + std::to_string(new_files) + " new ones");
  return new_files != 0;
}

/// Waits for a program that puts its files into `folder`.
void wait_for_lock(const fs::path& folder) {
  const int handle = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY);
  ::flock(handle, LOCK_SH);
  ::close(handle);
}

bool has_ready_files(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator{folder})
    if (entry.path().extension() == ".ready") return true;
  return false;
}

/// Points of a narrow floor, longer for the second: their pictures are quickly drawn.
void write_cloud(const fs::path& path, std::uint64_t seed) {
  orbis::point_cloud cloud;
  orbis::random_bits random{seed};
  for (int i = 0; i != 1500; ++i) {
    const double along = random.uniform(0.0, 4.0 + static_cast<double>(seed)), aside = random.uniform(0.0, 0.02);
    cloud.points.emplace_back(static_cast<float>(along), static_cast<float>(aside), 1.0F);
  }
  check(orbis::io::write_ply(path, cloud).has_value(), "no cloud");
}

}  // namespace

int main(int argc, char** argv) {
  check(argc == 3, "usage: end_runs RGBD_SLAM FOLDER");
  program = fs::absolute(argv[1]).string();
  const fs::path work = fs::absolute(argv[2]), out = work / "out";
  fs::remove_all(work);
  fs::create_directories(work);
  write_cloud(work / "first.ply", 1);
  write_cloud(work / "second.ply", 2);
  const auto map_of = [&](const char* cloud) -> std::vector<std::string> {
    return {"map",
            (work / cloud).string(),
            "--out",
            out.string(),
            "--quiet",
            "--resolution",
            "0.1",
            "--threads",
            "1",
            "--filter",
            "none",
            "--origin",
            "3,0,2",
            "--floor-map",
            (out / "floor.yaml").string()};
  };

  // What the two runs write.
  check(run{map_of("second.ply")}.wait() == 0, "the second cloud cannot be mapped");
  const folder_content after = content_of(out);
  check(run{map_of("first.ply")}.wait() == 0, "the first cloud cannot be mapped");
  const folder_content before = content_of(out);
  check(before.at("floor.pgm") != after.at("floor.pgm"), "both clouds have the same floor");
  check(before.size() == 13, "there are " + std::to_string(before.size()) + " files");
  auto start = clock_type::now();
  check(run{map_of("second.ply")}.wait() == 0, "the second cloud cannot be mapped again");
  const seconds whole = clock_type::now() - start;

  // Killed at 30 moments from its start to its end.
  int new_ones = 0;
  for (int i = 0; i != 30; ++i) {
    put_back(out, before);
    run victim{map_of("second.ply")};
    std::this_thread::sleep_for(whole * (i + 0.5) / 30);
    victim.send(SIGKILL);
    victim.wait();
    wait_for_lock(out);  // the process that puts the files in place outlives the program
    new_ones += is_new(content_of(out), before, &after, "killed at moment " + std::to_string(i)) ? 1 : 0;
  }
  check(new_ones != 30, "no run was killed before its end");

  // Killed while the files are put in place: the program's last part finishes, and who locks the folder sees that.
  for (int i = 0; i != 10; ++i) {
    put_back(out, before);
    run victim{map_of("second.ply")};
    while (!victim.is_over() && !has_ready_files(out)) {
    }
    const auto until = clock_type::now() + std::chrono::microseconds{20 * i};
    while (clock_type::now() < until) {
    }
    victim.send(SIGKILL);
    victim.wait();
    wait_for_lock(out);
    is_new(content_of(out), before, &after, "killed while files are put in place " + std::to_string(i));
  }
  // The next run removes what killed ones have left.
  check(run{map_of("second.ply")}.wait() == 0, "no run after the killed ones");
  check(is_new(content_of(out), before, &after, "after the killed runs"), "the last run has not written");
  check(hidden_in(out) == 0, "hidden files are left");

  // A machine that stops between two renames: the next run finishes first, whatever becomes of it then.
  put_back(out, before);
  fs::create_directories(out / ".rgbd_slam-000000.ready");
  for (const auto& [name, bytes] : after)
    if (name == "map.bt")  // was put in place
      std::ofstream{out / name, std::ios::binary} << bytes;
    else
      std::ofstream{out / ".rgbd_slam-000000.ready" / name, std::ios::binary} << bytes;
  std::ofstream{out / ".rgbd_slam-000000.ready" / "other"} << "is none of ours";
  fs::create_directories(out / ".rgbd_slam-000000.ready" / ".rgbd_slam");
  std::ofstream list{out / ".rgbd_slam-000000.ready" / ".rgbd_slam" / "names", std::ios::binary};
  for (const auto& [name, bytes] : after) list << name << '\0';
  list.close();
  std::ofstream{work / "none.ply"} << "no cloud";
  check(run{map_of("none.ply")}.wait() == 2, "a damaged cloud");
  check(is_new(content_of(out), before, &after, "a machine that stopped"),
        "the half that was left is not put in place");
  check(hidden_in(out) == 0, "hidden files are left");

  // Errors while the files are made: no file may be larger than some bytes.
  put_back(out, before);
  for (const rlim_t largest : {100U, 2000U, 19000U}) {
    check(run{map_of("second.ply"), largest}.wait() == 2, "a full disk is no error");
    check(!is_new(content_of(out), before, &after, "full disk"), "a full disk lets a run write");
    check(hidden_in(out) == 0, "a full disk leaves hidden files");
  }

  // Two at once: the folder is the one's or the other's.
  for (int i = 0; i != 5; ++i) {
    run one{map_of("first.ply")}, other{map_of("second.ply")};
    check(one.wait() == 0 && other.wait() == 0, "one of two programs at once fails");
    folder_content left = content_of(out), first = before, second = after;
    for (folder_content* content : {&left, &first, &second})
      std::erase_if(*content, [](const auto& f) { return is_dated(f.first); });
    check(left == first || left == second, "two at once leave files of both");
    check(hidden_in(out) == 0, "two at once leave hidden files");
  }

  // Interrupted: what was reached takes the place of all that was; twice: nothing does.
  const auto demo = [&](const char* seed, const char* frames) -> std::vector<std::string> {
    return {"demo",
            "--plain",
            "--out",
            (work / "demo").string(),
            "--quiet",
            "--width",
            "160",
            "--seed",
            seed,
            "--resolution",
            "0.2",
            "--filter",
            "none",
            "--frames",
            frames,
            "--save-map",
            (work / "demo" / "room.map").string()};
  };
  check(run{demo("1", "6")}.wait() == 0, "no demo");
  const folder_content room = content_of(work / "demo");
  check(room.size() == 16, "a demo makes " + std::to_string(room.size()) + " files");
  for (const int signal : {SIGINT, SIGTERM}) {
    bool kept = false;
    for (seconds wait{0.5}; !kept; wait *= 2) {  // until it has come to tracking
      check(wait.count() < 100, "an interrupted run has kept nothing");
      put_back(work / "demo", room);
      run endless{demo("2", "100000")};
      std::this_thread::sleep_for(wait);
      endless.send(signal);
      const int end = endless.wait();
      check(end == 130 || end == -signal, "an interrupted run leaves with " + std::to_string(end));
      kept = is_new(content_of(work / "demo"), room, nullptr, "interrupted");
      check(hidden_in(work / "demo") == 0, "an interrupted run leaves hidden files");
      check(!kept || end == 130, "a run that has kept something does not say that it was interrupted");
    }
  }
  // Killed while the live map grows and its depth images are in a file: that is gone with it.
  if (fs::exists("/proc/self/fd"))
    for (int i = 0; i != 3; ++i) {
      put_back(work / "demo", room);
      std::vector<std::string> spilling = demo("2", "100000");
      spilling.insert(spilling.end(), {"--depth-memory", "0", "--map-every-frame"});
      run endless{spilling};
      const auto has_spilled = [&] { return endless.nameless(".rgbd_slam.depths") == 1; };
      for (int wait = 0; !has_spilled(); ++wait) {
        check(wait < 6000 && !endless.is_over(), "no depth image was spilled");
        std::this_thread::sleep_for(std::chrono::milliseconds{10});
      }
      std::this_thread::sleep_for(std::chrono::milliseconds{70 * i});
      endless.send(SIGKILL);
      check(endless.wait() == -SIGKILL, "a killed run goes on");
      check(!is_new(content_of(work / "demo"), room, nullptr, "killed beside the live map"), "killed, and written");
      check(hidden_in(work / "demo") == 1, "a killed run leaves more than its hidden folder");
      for (const auto& entry : fs::recursive_directory_iterator{work / "demo"})
        check(entry.path().filename().string().find("spill") == std::string::npos, "a spill file is left");
    }

  // Ended as soon as its hidden folder is there.
  put_back(work / "demo", room);
  for (int i = 0; i != 20; ++i) {
    run endless{demo("2", "100000")};
    while (!endless.is_over() && hidden_in(work / "demo") == 0) {
    }
    const int signal = i % 2 == 0 ? SIGINT : SIGTERM;
    endless.send(signal);
    const int end = endless.wait();
    check(end == 130 || end == -signal, "a run that is ended at its beginning leaves with " + std::to_string(end));
    // On a busy machine the signal may come when there is something to keep.
    const bool kept = is_new(content_of(work / "demo"), room, nullptr, "ended at its beginning");
    check(!kept || end == 130, "a run that has kept something does not say that it was interrupted");
    if (kept) put_back(work / "demo", room);
    check(hidden_in(work / "demo") == 0, "a run that is ended at its beginning leaves hidden files");
  }

  // Ended while it waits for another program that holds the folder.
  for (int i = 0; i != 2; ++i) {
    put_back(work / "demo", room);
    const int handle = ::open((work / "demo").c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    check(::flock(handle, LOCK_EX) == 0, "the folder cannot be locked");
    run waiting{demo("2", "100000")};
    std::this_thread::sleep_for(seconds{0.3 + i});
    waiting.send(SIGTERM);
    for (int wait = 0; !waiting.is_over(); ++wait) {
      check(wait < 6000, "a run that waits for another one cannot be ended");
      std::this_thread::sleep_for(std::chrono::milliseconds{10});
    }
    check(waiting.wait() == -SIGTERM, "a run that waits for another one and is ended leaves otherwise");
    ::close(handle);
    check(hidden_in(work / "demo") == 0, "a run that waits for another one leaves hidden files");
  }

  // Ended while it begins, and a second time while it makes its files.
  enum class ending { at_first, at_second, by_itself };
  const auto interrupt_twice = [&](seconds wait) {
    put_back(work / "demo", room);
    run endless{demo("2", "100000")};
    std::this_thread::sleep_for(wait);
    endless.send(SIGSTOP);
    endless.send(SIGINT);
    endless.send(SIGTERM);  // another one, so that the two cannot become one
    endless.send(SIGCONT);
    const int end = endless.wait();
    check(end == -SIGINT || end == -SIGTERM || end == 130,
          "a run that is interrupted twice leaves with " + std::to_string(end));
    const bool kept = is_new(content_of(work / "demo"), room, nullptr, "interrupted twice");
    check(hidden_in(work / "demo") == 0, "a run that is interrupted twice leaves hidden files");
    if (end == -SIGINT) return ending::at_first;
    return end == -SIGTERM && !kept ? ending::at_second : ending::by_itself;
  };
  for (int i = 0; i != 60; ++i) interrupt_twice(seconds{0.001 * i});
  // Once it has come to tracking, the second signal ends it. On a busy machine a run may come to its end before it sees
  // that one; most do not.
  int at_second = 0, by_itself = 0;
  for (seconds wait{0.1}; at_second + by_itself < 8; wait *= 1.2) {
    check(wait.count() < 60, "a run does not come to tracking");
    const ending end = interrupt_twice(wait);
    at_second += end == ending::at_second ? 1 : 0;
    by_itself += end == ending::by_itself ? 1 : 0;
  }
  check(at_second >= 4, "of 8 runs " + std::to_string(at_second) + " are ended by their second signal");
  std::printf("whole run %.3f s, %d of 30 killed after their end\n", whole.count(), new_ones);
  return 0;
}
