// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as the file of rgbd_slam --config, for the command that the first byte names. There are settings, each
// within its bounds, or one line that says what is wrong.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include <sys/mman.h>
#include <unistd.h>

// Its source, so that the fuzzer sees into it.
#include "fuzz/target.hpp"
#include "rgbd_slam/command_line.cpp"

namespace {

using namespace orbis;

/// A file in memory: on a disk, files take longer to write than to read.
class memory_file {
 public:
  memory_file() : file_{::memfd_create("orbis_fuzz", 0)} { fuzz::require(file_ >= 0, "there is memory for a file"); }
  memory_file(const memory_file&) = delete;
  memory_file& operator=(const memory_file&) = delete;
  ~memory_file() { ::close(file_); }
  [[nodiscard]] int descriptor() const { return file_; }
  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }
  void write(std::string_view bytes) const {
    const bool is_written = ::ftruncate(file_, 0) == 0 &&
                            ::pwrite(file_, bytes.data(), bytes.size(), 0) == static_cast<::ssize_t>(bytes.size());
    fuzz::require(is_written, "the file can be written");
  }
  /// What was written through the descriptor since it was empty.
  [[nodiscard]] std::string content() const {
    std::string text(static_cast<std::size_t>(::lseek(file_, 0, SEEK_CUR)), '\0');
    fuzz::require(::pread(file_, text.data(), text.size(), 0) == static_cast<::ssize_t>(text.size()),
                  "the file can be read");
    return text;
  }

 private:
  int file_;
};

/// What `work` writes on the standard error.
template <class Work>
[[nodiscard]] std::string complaint_of(Work&& work) {
  static const memory_file file;
  static const int kept = ::dup(STDERR_FILENO);
  fuzz::require(::ftruncate(file.descriptor(), 0) == 0, "a file can be emptied");
  ::lseek(file.descriptor(), 0, SEEK_SET);
  ::dup2(file.descriptor(), STDERR_FILENO);
  try {
    work();
  } catch (...) {  // which is to be seen
    ::dup2(kept, STDERR_FILENO);
    throw;
  }
  ::dup2(kept, STDERR_FILENO);
  return file.content();
}

template <class List, class T>
[[nodiscard]] bool is_one_of(const List& list, const T& value) {
  return std::find(std::begin(list), std::end(list), value) != std::end(list);
}

void check(const app::settings& s) {
  const auto within = [](double v, double low, double high) { return v >= low && v <= high; };
  fuzz::require(within(s.resolution, 0.001, 10.0) && within(s.radius, 1e-6, 1000.0) && within(s.sigma, 0.0, 1000.0),
                "numbers of the map are within their bounds");
  fuzz::require(within(s.robot_radius, 0.001, 10.0) && within(s.robot_height, 0.001, 10.0), "a robot has a size");
  fuzz::require(!s.max_depth || within(*s.max_depth, 0.1, 1000.0), "so is the depth");
  fuzz::require(!s.read_out_ms || within(*s.read_out_ms, 0.0, 200.0), "so is the time of the shutter");
  fuzz::require(s.stride >= 1 && s.stride <= 100'000'000 && s.frames <= 100'000'000, "so are numbers of frames");
  fuzz::require(s.width >= 160 && s.width <= 1920 && s.threads <= 1024 && s.viewer_port <= 65535, "and all others");
  fuzz::require(!s.neighbors || (*s.neighbors >= 1 && *s.neighbors <= 100'000), "and neighbours");
  fuzz::require(is_one_of(app::filter_names(), s.filter) && is_one_of(app::profile_names(), s.profile),
                "names are those that are known");
  fuzz::require(is_one_of(std::array{"auto", "rgbd", "stereo", "mono"}, s.sensor), "and so are sensors");
  fuzz::require(!s.gravity || (s.gravity->allFinite() && !s.gravity->isZero()), "gravity has a direction");
  fuzz::require(!s.origin || s.origin->allFinite(), "an origin is a point");
  fuzz::require(!s.out.empty(), "what the command line says stays");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static const memory_file file;
  file.write({reinterpret_cast<const char*>(data) + 1, size - 1});
  constexpr std::array commands{"run", "demo", "live", "map"};
  std::array<std::string, 7> words{"rgbd_slam", commands[data[0] % 4U], "--out", "somewhere", "--config", file.path(),
                                   "recording"};
  std::array<char*, 7> arguments{};
  std::transform(words.begin(), words.end(), arguments.begin(), [](std::string& w) { return w.data(); });
  const int count = words[1] == "demo" ? 6 : 7;  // which has no recording

  // Kept: its hundreds of options take a hundred times as long to make as to use.
  static app::command_line line;
  std::variant<app::settings, app::exit_code> got;
  const std::string said = complaint_of([&] { got = line.read(count, arguments.data()); });
  if (const auto* const s = std::get_if<app::settings>(&got)) {
    fuzz::accept();
    fuzz::require(said.empty(), "there is nothing to complain about");
    check(*s);
  } else {
    const auto code = std::get<app::exit_code>(got);
    fuzz::require(code == app::bad_usage || code == app::bad_input, "an exit code says what kind of fault it is");
    fuzz::require(said.starts_with("rgbd_slam: ") && said.find('\n') + 1 == said.size(), "one line says what is wrong");
  }
  return 0;
}
