// SPDX-License-Identifier: BSD-3-Clause
#include "interrupts.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include <poll.h>
#include <pthread.h>
#include <unistd.h>

namespace app::interrupts {
namespace {

using clock = std::chrono::steady_clock;

/// Time for dispensable work to complete after SIGTERM or SIGHUP.
constexpr std::chrono::seconds patience{5};

struct state {
  std::mutex mutex;  // guards the members below, except the atomic ones
  std::function<void()> clean_up, on_stop;
  std::string notice;
  int first = 0;  // the first signal after keep_results
  clock::time_point first_at{};
  bool is_dispensable = false;
  std::optional<clock::time_point> give_up_at;
  std::atomic<bool> keeps_results{false};
  std::atomic<bool> stop_requested{false};
};

/// Never destroyed, because the waiting thread may use it until the process ends.
state& shared() {
  static state& s = *new state;
  return s;
}

sigset_t watched() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  struct sigaction hang_up {};
  if (sigaction(SIGHUP, nullptr, &hang_up) == 0 && hang_up.sa_handler != SIG_IGN) sigaddset(&set, SIGHUP);  // not nohup
  return set;
}

[[noreturn]] void end_by(int signal) {
  std::signal(signal, SIG_DFL);
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, signal);
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
  for (;;) std::raise(signal);
}

/// Prints to standard error unless that would block, for example on a full pipe, so that the thread can handle further
/// signals. Uses no stream, because a blocked thread may hold the lock of a stream.
void print_without_blocking(const std::string& text) {
  pollfd out{STDERR_FILENO, POLLOUT, 0};
  if (::poll(&out, 1, 0) == 1 && (out.revents & POLLOUT) != 0)
    static_cast<void>(!::write(STDERR_FILENO, text.data(), text.size()));
}

[[noreturn]] void wait_for_signals(const sigset_t& set) {
  // `timeout` sends its signal to its child and then to the whole group: the same signal twice within a tenth of a
  // second counts once.
  constexpr std::chrono::milliseconds together{100};
  for (;;) {
    int signal = 0;
    if (sigwait(&set, &signal) != 0) continue;
    state& s = shared();
    const std::lock_guard lock{s.mutex};
    const auto now = clock::now();
    if (s.stop_requested && signal == s.first && now - s.first_at < together) continue;
    if (s.keeps_results && !s.stop_requested.exchange(true)) {
      s.first = signal;
      s.first_at = now;
      if (s.is_dispensable) s.give_up_at = now;
      print_without_blocking(s.notice);
      if (s.on_stop) s.on_stop();
      continue;
    }
    if (s.clean_up) s.clean_up();
    end_by(signal);
  }
}

}  // namespace

void start() {
  // An ignored signal would never arrive, and without SIGCHLD the exit code of a child process would be lost.
  for (const int signal : {SIGINT, SIGTERM, SIGCHLD}) std::signal(signal, SIG_DFL);
  const sigset_t set = watched();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  static_cast<void>(shared());
  std::thread{[set] { wait_for_signals(set); }}.detach();
}

void keep_results(std::string notice, std::function<void()> on_stop) {
  state& s = shared();
  const std::lock_guard lock{s.mutex};
  s.notice = std::move(notice);
  s.on_stop = std::move(on_stop);
  s.keeps_results = true;
}

void forget_stop() {
  state& s = shared();
  const std::lock_guard lock{s.mutex};
  s.on_stop = {};
}

bool stop_requested() { return shared().stop_requested; }

void begin_dispensable(std::string notice) {
  state& s = shared();
  const std::lock_guard lock{s.mutex};
  s.notice = std::move(notice);
  s.is_dispensable = true;
  if (s.stop_requested && s.first != SIGINT) s.give_up_at = s.first_at + patience;
}

bool is_given_up() {
  if (!stop_requested()) return false;
  state& s = shared();
  const std::lock_guard lock{s.mutex};
  return s.give_up_at && clock::now() >= *s.give_up_at;
}

bool end_dispensable() {
  state& s = shared();
  const std::lock_guard lock{s.mutex};
  s.notice.clear();
  s.is_dispensable = false;
  return s.stop_requested;
}

void end_program(int code) {
  std::fflush(nullptr);
  state& s = shared();
  const std::lock_guard lock{s.mutex};
  if (s.clean_up) s.clean_up();
  std::_Exit(code);
}

void set_clean_up(std::function<void()> clean_up) {
  state& s = shared();
  const std::lock_guard lock{s.mutex};
  s.clean_up = std::move(clean_up);
}

}  // namespace app::interrupts
