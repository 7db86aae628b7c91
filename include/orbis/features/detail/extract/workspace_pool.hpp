// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Pool of reusable workspaces.
#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace orbis::features::detail {

/// A pool of workspaces: each call acquires one and returns it. Concurrent calls use separate workspaces; sequential
/// calls reuse one. A workspace that is not returned (after an exception) is freed. Copies of the pool are empty.
template <class Workspace>
class workspace_pool {
 public:
  workspace_pool() = default;
  workspace_pool(const workspace_pool&) noexcept : workspace_pool{} {}
  workspace_pool& operator=(const workspace_pool&) noexcept { return *this; }
  ~workspace_pool() = default;

  [[nodiscard]] std::unique_ptr<Workspace> acquire() {
    {
      const std::lock_guard lock{mutex_};
      if (!free_.empty()) {
        auto last = std::move(free_.back());
        free_.pop_back();
        return last;
      }
    }
    return std::make_unique<Workspace>();
  }
  void release(std::unique_ptr<Workspace> workspace) {
    const std::lock_guard lock{mutex_};
    free_.push_back(std::move(workspace));
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<Workspace>> free_;
};

}  // namespace orbis::features::detail
