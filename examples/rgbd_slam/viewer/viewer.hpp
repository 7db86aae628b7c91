// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The live viewer: shows tracking and mapping during the run, in a window or in a browser.
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

/// Shows a run on a separate low-priority thread. Tracking puts its newest frame into a mailbox; it never waits for
/// drawing or for a lock that the viewer's thread holds. If the user closes the viewer or the viewer fails, the run
/// continues. Without `--viewer`, no call has an effect.
class viewer {
 public:
  /// Opens the viewer selected in the settings and prints its address. Errors: no display; the port is in use.
  [[nodiscard]] static orbis::result<viewer> open(const settings& s, const frame_source& source, console& console);

  /// Replaces the camera, between two connections.
  void set_camera(const frame_source& source);

  /// If the viewer is open, shows the frame that `make()` returns. Call it from one thread only.
  template <std::invocable Make>
  void show(Make&& make) noexcept {
    if (thread_) thread_->show(std::forward<Make>(make));
  }

  /// Connects the viewer to its sources during the lifetime of this object; at the end, queries the sources one last
  /// time.
  class connection {
   public:
    connection(viewer& v, scene_sources sources);
    connection(const connection&) = delete;
    connection& operator=(const connection&) = delete;
    ~connection();

   private:
    viewer& viewer_;
  };

  /// Closes the viewer with a warning that its threads are needed elsewhere. Returns false if no viewer is open.
  bool give_way(console& console);
  /// Shows the final map.
  void show_map(const std::vector<voxel>& voxels);
  /// Prints the error that ended the viewer, once.
  void report_error(console& console);
  /// With `--viewer-hold`, waits until the user closes the viewer or presses Ctrl-C.
  void finish(const settings& s, console& console);

 private:
  explicit viewer(std::unique_ptr<viewer_thread> thread) : thread_{std::move(thread)} {}
  std::unique_ptr<viewer_thread> thread_;  // null: no viewer
};

}  // namespace app
