// SPDX-License-Identifier: BSD-3-Clause
//
// The command benchmark: runs this program on recordings, in child processes, and prints a table of their results.
#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif

#include <orbis/core/file.hpp>
#include <orbis/io/recording.hpp>
#include <orbis/io/toml.hpp>

#include "commands.hpp"
#include "formatted_text.hpp"
#include "inputs/bag_file.hpp"
#include "interrupts.hpp"
#include "source.hpp"
#include "staged_folder.hpp"
#include "summary.hpp"

namespace app {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::ordered_json;

// -- recordings ------------------------------------------------------------------------------------------------------

struct found_recording {
  std::string name;  ///< unique
  fs::path path;
};

/// Returns true for the folder of a 7-Scenes sequence, and for the folder of a scene, which contains sequences.
bool is_scene(const fs::path& path) {
  return orbis::io::detect_format(path) == orbis::io::recording_format::seven_scenes;
}

/// Adds the recordings in and below `path` in the order of their names, but not recordings inside other recordings.
/// `seen`: canonical paths of the folders visited so far.
void find_recordings(const fs::path& path, std::set<fs::path>& seen, std::vector<fs::path>& found) {
  std::error_code failure;
  if (!seen.insert(fs::weakly_canonical(path, failure)).second) return;
  const bool is_whole = is_recording(path), may_be_scene = is_whole && is_scene(path);
  if (is_whole && !may_be_scene) return found.push_back(path);
  std::vector<fs::path> inside;
  for (fs::directory_iterator it{path, failure}, end; !failure && it != end; it.increment(failure)) {
    std::error_code ignored;
    const bool is_hidden = it->path().filename().string().starts_with('.');
    if (!is_hidden && (it->is_directory(ignored) || is_recording(it->path()))) inside.push_back(it->path());
  }
  if (may_be_scene && std::count_if(inside.begin(), inside.end(), is_scene) < 2) return found.push_back(path);
  std::sort(inside.begin(), inside.end());
  for (const fs::path& p : inside) find_recordings(p, seen, found);
}

/// The recordings selected by the settings. Errors: not_found, no_data.
orbis::result<std::vector<found_recording>> chosen_recordings(const settings& s) {
  std::vector<found_recording> all;
  std::set<fs::path> seen;
  std::set<std::string> names;
  for (const fs::path& folder : s.inputs) {
    std::error_code ignored;
    if (!fs::exists(folder, ignored)) return orbis::fail(orbis::errc::not_found, folder.string(), "does not exist");
    std::vector<fs::path> found;
    find_recordings(folder, seen, found);
    if (found.empty())
      return orbis::fail(orbis::errc::no_data, folder.string(),
                         "contains no recordings, or only recordings that are already listed");
    for (const fs::path& path : found) {
      const fs::path inside = path == folder ? fs::path{} : path.lexically_relative(folder);
      const std::string name = inside.empty() ? fs::weakly_canonical(path).filename().string() : inside.string();
      std::string unique = name;
      for (int copy = 2; !names.insert(unique).second; ++copy) unique = name + "-" + std::to_string(copy);
      all.push_back({unique, path});
    }
  }
  return all;
}

// -- published figures -----------------------------------------------------------------------------------------------

constexpr std::array systems = {"ORB-SLAM2", "ElasticFusion", "BundleFusion", "BAD SLAM", "RTAB-Map"};

constexpr const char* sources =
    "ORB-SLAM2 and ElasticFusion: R. Mur-Artal, J. D. Tardos, IEEE Transactions on Robotics 33(5), 2017, Table III\n"
    "(ORB-SLAM2 on fr2: depths corrected by 4 %). BundleFusion: A. Dai et al., ACM Transactions on Graphics 36(4), "
    "2017.\n"
    "BAD SLAM: T. Schoeps et al., CVPR 2019. RTAB-Map: M. Labbe, F. Michaud, Journal of Field Robotics 36(2), 2019.\n";

/// Published ATE RMSE of RGB-D systems on complete recordings of the TUM benchmark, in millimetres; 0: not published.
struct published_figures {
  const char* recording;
  std::array<double, systems.size()> ate_mm;
};
constexpr std::array<published_figures, 7> published = {{
    {"fr1_desk", {16, 20, 16, 17, 29}},
    {"fr1_desk2", {22, 48, 0, 0, 44}},
    {"fr1_room", {47, 68, 0, 0, 66}},
    {"fr2_desk", {9, 71, 0, 0, 24}},
    {"fr2_xyz", {4, 11, 11, 11, 5}},
    {"fr3_long_office_household", {10, 17, 22, 17, 21}},
    {"fr3_nostructure_texture_near_withloop", {19, 16, 12, 0, 17}},
}};

/// Finds the published figures for a recording by its name: "fr1_desk", "rgbd_dataset_freiburg1_desk", "fr3_office".
const published_figures* find_figures(const fs::path& recording) {
  std::string name = fs::weakly_canonical(recording).filename().string();
  if (name.ends_with(".bag")) name.resize(name.size() - 4);
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  constexpr std::string_view prefix = "rgbd_dataset_", place = "freiburg";
  if (name.starts_with(prefix)) name.erase(0, prefix.size());
  if (name.starts_with(place)) name.replace(0, place.size(), "fr");
  if (name == "fr3_office") name = "fr3_long_office_household";
  if (name == "fr3_nst") name = "fr3_nostructure_texture_near_withloop";
  const auto found =
      std::find_if(published.begin(), published.end(), [&](const published_figures& p) { return p.recording == name; });
  return found == published.end() ? nullptr : &*found;
}

// -- runs ------------------------------------------------------------------------------------------------------------

/// A mode of running a recording.
struct run_mode {
  std::string name;
  bool deterministic;
  std::size_t busy_loops;  ///< number of threads that keep processors busy during the run
};

struct outcome {
  json summary;  ///< null if the run failed
  double cpu_s = 0.0, peak_mb = 0.0;
  std::string failure;  ///< the reason why the run failed; empty if it succeeded

  /// A number in the summary.
  [[nodiscard]] std::optional<double> number(const char* pointer) const {
    if (!summary.is_object()) return std::nullopt;
    const json value = summary.value(json::json_pointer{pointer}, json{});
    return value.is_number() ? std::optional{value.get<double>()} : std::nullopt;
  }
};

/// Runs this program in child processes, one at a time. An interrupt kills the process and removes the temporary
/// folder.
class runner {
 public:
  /// @pre no other runner exists
  explicit runner(fs::path temporary) : temporary_{std::move(temporary)} {
    interrupts::set_clean_up([this] { stop(); });
  }
  runner(const runner&) = delete;
  runner& operator=(const runner&) = delete;
  ~runner() {
    interrupts::set_clean_up({});
    remove_all();
  }

  /// The folder for temporary results.
  [[nodiscard]] fs::path scratch() const { return temporary_ / "out"; }

  /// Runs the program with these arguments and `--out`.
  outcome run(std::vector<std::string> arguments, const fs::path& out) {
    arguments.insert(arguments.begin(), "rgbd_slam");
    arguments.insert(arguments.end(), {"--out", out.string(), "--quiet"});
    std::vector<char*> argv;
    for (std::string& a : arguments) argv.push_back(a.data());
    argv.push_back(nullptr);
    const fs::path log = temporary_ / "log";

    std::unique_lock lock{mutex_};
    out_ = out;
    const pid_t parent = ::getpid();
    process_ = ::fork();
    if (process_ == 0) become(argv.data(), log.c_str(), parent);
    if (process_ < 0) {
      process_ = 0;
      outcome o;
      o.failure = "cannot be started: " + std::generic_category().message(errno);
      return o;
    }
    const pid_t process = process_;
    lock.unlock();
    wait_for(process);
    lock.lock();
    int status = 0;
    rusage used{};
    const bool has_status = ::wait4(process_, &status, 0, &used) == process_;
    process_ = 0;
    lock.unlock();

    outcome o;
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    o.cpu_s = seconds(used.ru_utime) + seconds(used.ru_stime);
    o.peak_mb = static_cast<double>(used.ru_maxrss) / 1024.0;
    if (!has_status) {
      o.failure = "its exit code is unknown";
    } else if (status == 0) {
      const auto text = orbis::read_file(out / "summary.json");
      o.summary = text ? json::parse(*text, nullptr, false) : json{};
      if (!o.summary.is_object()) o.failure = "summary.json cannot be read";
    } else if (WIFEXITED(status) && WEXITSTATUS(status) == not_started) {
      o.failure = "cannot be started";
    } else {
      o.failure = WIFSIGNALED(status) ? std::string{"ended by "} + ::strsignal(WTERMSIG(status)) : last_error(log);
    }
    return o;
  }

 private:
  static constexpr int not_started = 127;  // exit code

  /// Runs in the child process after the fork from `parent`, and executes this program again. Makes only system calls.
  [[noreturn]] static void become(char** argv, const char* log, [[maybe_unused]] pid_t parent) {
#ifdef __linux__
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(not_started);  // the parent has already ended
#endif
    const int file = ::open(log, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (file < 0) ::_exit(not_started);
    if (file <= STDERR_FILENO) ::fcntl(file, F_SETFD, 0);  // dup2 may have no effect on this descriptor
    ::dup2(file, STDOUT_FILENO);
    ::dup2(file, STDERR_FILENO);
    ::execv("/proc/self/exe", argv);
    ::_exit(not_started);
  }

  /// Waits until a process has ended, without reaping it.
  static void wait_for(pid_t process) {
    siginfo_t ignored{};
    while (::waitid(P_PID, static_cast<id_t>(process), &ignored, WEXITED | WNOWAIT) != 0 && errno == EINTR) {
    }
  }

  static std::string last_error(const fs::path& log) {
    const std::string text = orbis::read_file(log).value_or(std::string{});
    constexpr std::string_view start = "rgbd_slam: ";
    const std::size_t at = text.rfind(start);
    if (at == std::string::npos) return "ended without a message";
    return text.substr(at + start.size(), text.find('\n', at) - at - start.size());
  }

  void remove_all() {
    std::error_code ignored;
    fs::remove_all(temporary_, ignored);
  }

  /// Ends all runs; called on the thread that waits for signals. The lock remains held, so that no other run starts.
  void stop() {
    mutex_.lock();
    if (process_ > 0) {
      ::kill(process_, SIGKILL);
      wait_for(process_);
      static_cast<void>(staged_folder::finish(out_));
      std::error_code ignored;
      fs::remove(out_, ignored);  // if it is empty
    }
    remove_all();
  }

  fs::path temporary_;
  std::mutex mutex_;
  pid_t process_ = 0;
  fs::path out_;  ///< output folder of the process
};

/// Creates an empty temporary folder. Errors: write_failed.
orbis::result<fs::path> make_temporary_folder() {
  std::string name = (fs::temp_directory_path() / "rgbd_slam-benchmark-XXXXXX").string();
  if (::mkdtemp(name.data()) != nullptr) return name;
  return orbis::fail(orbis::errc::write_failed, name, std::generic_category().message(errno));
}

std::vector<run_mode> chosen_modes(const settings& s) {
  std::vector<run_mode> modes{{"deterministic", true, 0}};
  if (s.quick) return modes;
  modes.push_back({"threads", false, 0});
  for (const std::size_t load : {1U, 2U}) modes.push_back({"threads-" + std::to_string(load) + "-busy", false, load});
  return modes;
}

/// Runs one recording while other threads keep processors busy.
outcome run_recording(runner& runs, const found_recording& recording, const run_mode& mode, const settings& s) {
  std::vector<std::string> arguments{"run", fs::absolute(recording.path).string()};
  if (mode.deterministic) arguments.emplace_back("--deterministic");
  if (s.frames != 0) arguments.insert(arguments.end(), {"--frames", std::to_string(s.frames)});
  if (s.stride != 1) arguments.insert(arguments.end(), {"--stride", std::to_string(s.stride)});
  if (!s.run_config.empty()) arguments.insert(arguments.end(), {"--config", s.run_config.string()});
  std::vector<std::jthread> busy;
  for (std::size_t i = 0; i != mode.busy_loops; ++i)
    busy.emplace_back([](const std::stop_token& end) {
      while (!end.stop_requested()) {
      }
    });
  return runs.run(std::move(arguments), s.out.empty() ? runs.scratch() : s.out / recording.name / mode.name);
}

// -- tables ----------------------------------------------------------------------------------------------------------

struct row {
  const found_recording* recording;
  const run_mode* mode;
  outcome result;
};

using table = std::vector<std::vector<std::string>>;  ///< rows of equal length; the first one is the header

/// Formats a value, or returns "-" if there is none.
std::string cell(const char* format, const std::optional<double>& value, double factor = 1.0) {
  return value ? text(format, factor * *value) : "-";
}

/// The ratio `a` / `b`, times `factor`; empty if one of the numbers is unknown or `b` is zero.
std::optional<double> ratio(std::optional<double> a, std::optional<double> b, double factor = 1.0) {
  if (!a || !b || *b == 0.0) return std::nullopt;
  return factor * *a / *b;
}

std::optional<double> cpu_ms(const outcome& o) { return ratio(o.cpu_s, o.number("/frames"), 1000.0); }
std::optional<double> removed_percent(const outcome& o) {
  const auto points = o.number("/cloud/points"), kept = o.number("/cloud/points_filtered");
  return points && kept ? ratio(*points - *kept, points, 100.0) : std::nullopt;
}

table results_table(const std::vector<row>& rows) {
  table t{{"recording", "run", "frames", "tracked %", "ATE mm", "RPE mm", "CPU ms/frame", "peak MB", "points before",
           "points after", "removed %", "octree before", "octree after"}};
  const auto size = [](std::optional<double> bytes) {
    return bytes ? bytes_text(static_cast<std::uintmax_t>(*bytes)) : "-";
  };
  const auto count = [](std::optional<double> n) { return n ? count_text(static_cast<std::uintmax_t>(*n)) : "-"; };
  for (const row& r : rows) {
    const outcome& o = r.result;
    const auto frames = o.number("/frames");
    t.push_back({r.recording->name, r.mode->name, count(frames),
                 cell("%.1f", ratio(o.number("/tracked"), frames, 100.0)), cell("%.1f", o.number("/ate_rmse_m"), 1e3),
                 cell("%.2f", o.number("/rpe_trans_rmse_m"), 1e3), cell("%.1f", cpu_ms(o)), text("%.0f", o.peak_mb),
                 count(o.number("/cloud/points")), count(o.number("/cloud/points_filtered")),
                 cell("%.2f", removed_percent(o)), size(o.number("/octree/bt_bytes_unfiltered")),
                 size(o.number("/octree/bt_bytes"))});
  }
  if (std::any_of(rows.begin(), rows.end(), [](const row& r) { return !r.result.failure.empty(); })) {
    t.front().emplace_back("failure");
    for (std::size_t i = 0; i != rows.size(); ++i) t[i + 1].push_back(rows[i].result.failure);
  }
  return t;
}

/// A table that compares deterministic runs with the published figures for the same recordings; only the header if
/// there are no such runs.
table published_table(const std::vector<row>& rows) {
  table t{{"ATE mm", "this run"}};
  t.front().insert(t.front().end(), systems.begin(), systems.end());
  for (const row& r : rows) {
    const published_figures* known = find_figures(r.recording->path);
    if (known == nullptr || !r.mode->deterministic) continue;
    auto& line = t.emplace_back(std::vector{r.recording->name, cell("%.1f", r.result.number("/ate_rmse_m"), 1e3)});
    for (const double mm : known->ate_mm) line.push_back(mm != 0.0 ? text("%.0f", mm) : "-");
  }
  return t;
}

/// The table as text with aligned columns, or as Markdown. The first `left` columns and the column of failures are
/// aligned left, all others right.
std::string formatted(const table& t, bool markdown, std::size_t left) {
  std::vector<std::size_t> widths(t.front().size());
  for (const auto& line : t)
    for (std::size_t i = 0; i != line.size(); ++i) widths[i] = std::max(widths[i], line[i].size());
  const auto is_left = [&](std::size_t i) { return i < left || t.front()[i] == "failure"; };
  std::string all;
  for (const auto& line : t) {
    std::string written = markdown ? "|" : "";
    for (std::size_t i = 0; i != line.size(); ++i) {
      const std::string gap(widths[i] - line[i].size(), ' ');
      const std::string padded = is_left(i) ? line[i] + gap : gap + line[i];
      written += markdown ? " " + padded + " |" : (i == 0 ? "" : "  ") + padded;
    }
    written.erase(written.find_last_not_of(' ') + 1);
    all += written + "\n";
    if (!markdown || &line != &t.front()) continue;
    all += "|";
    for (std::size_t i = 0; i != line.size(); ++i) all += is_left(i) ? " --- |" : " ---: |";
    all += "\n";
  }
  return all;
}

std::string as_tables(const std::vector<row>& rows, bool markdown) {
  std::string all = formatted(results_table(rows), markdown, 2);
  const table known = published_table(rows);
  if (known.size() > 1)
    all += "\nPublished figures for complete recordings:\n\n" + formatted(known, markdown, 1) + "\n" + sources;
  return all;
}

std::string as_json(const std::vector<row>& rows) {
  json all = json::array();
  for (const row& r : rows) {
    json& j = all.emplace_back();  // NaN (unknown) is written as null
    j["recording"] = r.recording->name;
    j["path"] = r.recording->path.string();
    j["run"] = r.mode->name;
    j["failure"] = r.result.failure.empty() ? json{} : json(r.result.failure);
    j["cpu_ms_per_frame"] = cpu_ms(r.result).value_or(std::numeric_limits<double>::quiet_NaN());
    j["peak_mb"] = r.result.peak_mb;
    j["summary"] = r.result.summary;
    json& others = j["published_ate_rmse_m"];
    if (const published_figures* known = find_figures(r.recording->path))
      for (std::size_t i = 0; i != systems.size(); ++i)
        others[systems[i]] = known->ate_mm[i] != 0.0 ? json(1e-3 * known->ate_mm[i]) : json{};
  }
  return all.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

}  // namespace

exit_code benchmark(const settings& s, console& console) {
  if (!s.run_config.empty()) {
    const auto table = orbis::io::read_toml(s.run_config);
    if (!table) return console.error(table.error()), bad_input;
    for (const char* name : {"save-map", "floor-map"})
      if (table->contains(name))
        return console.error({orbis::errc::invalid_argument, s.run_config.string(),
                              std::string{name} + ": every run would replace the file; remove the option"}),
               bad_usage;
  }
  const auto recordings = chosen_recordings(s);
  if (!recordings) return console.error(recordings.error()), bad_input;
  auto temporary = make_temporary_folder();
  if (!temporary) return console.error(temporary.error()), bad_input;
  runner runs{*std::move(temporary)};
  const std::vector<run_mode> modes = chosen_modes(s);

  std::vector<row> rows;
  bool any_failed = false;
  for (const found_recording& recording : *recordings)
    for (const run_mode& mode : modes) {
      console.stage(recording.name);
      const outcome& o = rows.emplace_back(row{&recording, &mode, run_recording(runs, recording, mode, s)}).result;
      any_failed = any_failed || !o.failure.empty();
      console.finish(mode.name + ": " +
                     (o.failure.empty() ? "ATE " + cell("%.1f mm", o.number("/ate_rmse_m"), 1e3) + ", CPU " +
                                              cell("%.1f ms per frame", cpu_ms(o))
                                        : o.failure));
    }
  std::string text = s.json ? as_json(rows) : as_tables(rows, s.markdown);
  text.pop_back();  // print adds the line break
  if (!console.print(text))
    return console.error({orbis::errc::write_failed, "standard output", "cannot be written"}), bad_input;
  return any_failed ? run_failed : done;
}

}  // namespace app
