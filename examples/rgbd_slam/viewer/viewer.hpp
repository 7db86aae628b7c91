// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The live viewer: what tracking and mapping do, while they do it, in a window or in a browser.
#pragma once

#include <concepts>
#include <memory>
#include <utility>
#include <vector>

#include <orbis/core/result.hpp>

#include "console.hpp"
#include "settings.hpp"
#include "source.hpp"
#include "viewer/scene_builder.hpp"
#include "viewer/viewer_thread.hpp"

namespace app {

/// Shows a run on a thread of its own, of low priority. Tracking only leaves frames in a box, the newest in place of
/// the one before; it never waits for drawing, nor for a lock that the viewer's thread holds. When the user closes the
/// viewer, or it fails, the run goes on. Without `--viewer` all calls do nothing.
class viewer {
 public:
  /// Opens what the settings ask for, and says where it is to be seen. Errors: no display; the port is taken.
  [[nodiscard]] static orbis::result<viewer> open(const settings& s, const frame_source& source, console& console);

  /// Hands the frame over that `make()` returns, if somebody may be looking. For one thread.
  template <std::invocable Make>
  void show(Make&& make) noexcept {
    if (thread_) thread_->show(std::forward<Make>(make));
  }

  /// As long as this lives, the viewer asks the sources; in the end once more.
  class connection {
   public:
    connection(viewer& v, scene_sources sources);
    connection(const connection&) = delete;
    connection& operator=(const connection&) = delete;
    ~connection();

   private:
    viewer& viewer_;
  };

  /// Shows the map that was made in the end.
  void show_map(const std::vector<voxel>& voxels);
  /// Tells why the viewer ended, if it did so on its own, and was not told before.
  void tell_trouble(console& console);
  /// With `--viewer-hold`, waits until the user has closed the viewer or pressed Ctrl-C.
  void finish(const settings& s, console& console);

 private:
  explicit viewer(std::unique_ptr<viewer_thread> thread) : thread_{std::move(thread)} {}
  std::unique_ptr<viewer_thread> thread_;  // null: nothing is shown
};

}  // namespace app
