// SPDX-License-Identifier: BSD-3-Clause
#include "console.hpp"

#include <cstdio>

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <orbis/core/quote.hpp>

#include "../common/report_error.hpp"

namespace app {
using examples::one_line;

console::console(bool quiet) : quiet_{quiet}, terminal_{::isatty(STDERR_FILENO) == 1} {
  auto sink = std::make_shared<spdlog::sinks::stderr_color_sink_mt>();
  sink->set_color(spdlog::level::info, sink->reset);
  log_ = std::make_shared<spdlog::logger>("rgbd_slam", sink);
  log_->set_pattern("%^%v%$");
  log_->set_level(quiet ? spdlog::level::err : spdlog::level::info);
  log_->flush_on(spdlog::level::info);
}

console console::for_dispensable() const {
  console made{*this};
  made.is_dispensable_ = true;
  return made;
}

double console::elapsed() const { return std::chrono::duration<double>(clock::now() - stage_start_).count(); }
double console::total() const { return std::chrono::duration<double>(clock::now() - program_start_).count(); }

void console::stage(std::string_view name, clock::time_point start) {
  stage_ = name;
  stage_start_ = start;
  last_shown_ = clock::now();
  if (terminal_ && !quiet_ && !is_silent()) {
    std::fprintf(stderr, "\r\033[2K%-10s ...", stage_.c_str());
    std::fflush(stderr);
    *bar_shown_ = true;
  }
}

void console::advance(std::size_t done, std::size_t total, const std::string& note) {
  if (quiet_ || total == 0 || is_silent()) return;
  const auto now = clock::now();
  const double since = std::chrono::duration<double>(now - last_shown_).count();
  if (since < (terminal_ ? 0.1 : 10.0)) return;
  last_shown_ = now;
  const double seconds = elapsed();
  const double rate = seconds > 0 ? static_cast<double>(done) / seconds : 0.0;
  const bool is_known = total != std::numeric_limits<std::size_t>::max();  // not for a live camera
  std::string tail = is_known ? fmt::format("{}/{}", done, total) : fmt::format("{}", done);
  if (!note.empty()) tail += fmt::format("  {:.1f} fps  {}", rate, note);
  if (!terminal_) {
    log_->info("{:<10} {}", stage_, tail);
    return;
  }
  constexpr std::size_t cells = 28;
  const std::size_t full = is_known ? std::min(cells, done * cells / total) : 0;
  std::fprintf(stderr, "\r\033[2K%-10s [%s%s] %s", stage_.c_str(), std::string(full, '#').c_str(),
               std::string(cells - full, '.').c_str(), tail.c_str());
  std::fflush(stderr);
  *bar_shown_ = true;
}

void console::finish(const std::string& outcome) {
  if (is_silent()) return;
  clear_bar();
  log_->info("{:<10} {:<72} {:6.1f} s", stage_, one_line(outcome), elapsed());
}

void console::warn(const std::string& message) {
  if (is_silent()) return;
  clear_bar();
  log_->warn("rgbd_slam: warning: {}", one_line(message));
}

void console::error(const orbis::error& e) {
  if (is_silent()) return;
  clear_bar();
  std::string text = orbis::shortened_path(e.where) + (e.where.empty() ? "" : ": ");
  for (std::size_t begin = 0; begin <= e.message.size();) {  // a message may have several lines
    const std::size_t end = std::min(e.message.find('\n', begin), e.message.size());
    text += (begin == 0 ? "" : "\n") + one_line(e.message.substr(begin, end - begin));
    begin = end + 1;
  }
  log_->error("rgbd_slam: {}", text);
}

bool console::print(const std::string& line) {
  clear_bar();
  return quiet_ || (std::fputs((line + "\n").c_str(), stdout) >= 0 && std::fflush(stdout) == 0);
}

void console::clear_bar() {
  if (!bar_shown_->exchange(false)) return;
  std::fputs("\r\033[2K", stderr);
  std::fflush(stderr);
}

}  // namespace app
