// SPDX-License-Identifier: BSD-3-Clause
#include "interrupts.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <mutex>
#include <thread>
#include <utility>

#include <pthread.h>

namespace app::interrupts {
namespace {

struct state {
  std::mutex mutex;  // guards clean_up and notice
  std::function<void()> clean_up;
  std::string notice;
  std::atomic<bool> keeps_results{false};
  std::atomic<bool> stop_requested{false};
};

/// Never destroyed, as the waiting thread may use it until the process ends.
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

[[noreturn]] void wait_for_signals(const sigset_t& set) {
  // `timeout` sends its signal to its child and then to the whole group: the same signal twice within a tenth of a
  // second counts once.
  constexpr std::chrono::milliseconds together{100};
  std::chrono::steady_clock::time_point first_at{};
  int first = 0;
  for (;;) {
    int signal = 0;
    if (sigwait(&set, &signal) != 0) continue;
    state& s = shared();
    const std::lock_guard lock{s.mutex};
    const auto now = std::chrono::steady_clock::now();
    if (s.stop_requested && signal == first && now - first_at < together) continue;
    if (s.keeps_results && !s.stop_requested.exchange(true)) {
      first = signal;
      first_at = now;
      std::fputs(s.notice.c_str(), stderr);
      std::fflush(stderr);
      continue;
    }
    if (s.clean_up) s.clean_up();
    end_by(signal);
  }
}

}  // namespace

void start() {
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_DFL);  // an ignored signal would never arrive
  const sigset_t set = watched();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  static_cast<void>(shared());
  std::thread{[set] { wait_for_signals(set); }}.detach();
}

void keep_results(std::string notice) {
  state& s = shared();
  const std::lock_guard lock{s.mutex};
  s.notice = std::move(notice);
  s.keeps_results = true;
}

void discard_results() { shared().keeps_results = false; }
bool stop_requested() { return shared().stop_requested; }

void set_clean_up(std::function<void()> clean_up) {
  state& s = shared();
  const std::lock_guard lock{s.mutex};
  s.clean_up = std::move(clean_up);
}

}  // namespace app::interrupts
