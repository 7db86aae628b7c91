// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The live viewer: what tracking and mapping do, while they do it, in a window or in a browser.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <orbis/core/result.hpp>

#include "console.hpp"
#include "settings.hpp"
#include "source.hpp"
#include "viewer/scene_builder.hpp"

namespace app {

/// Shows a run on a thread of its own, of low priority. Tracking only leaves frames in a box, the newest in place of
/// the one before; it never waits for drawing. When the user closes the viewer, or it fails, the run goes on. Without
/// `--viewer` all calls do nothing.
class viewer {
 public:
  /// Opens what the settings ask for, and says where it is to be seen. Errors: no display; the port is taken.
  [[nodiscard]] static orbis::result<viewer> open(const settings& s, const frame_source& source, console& console);
  viewer(viewer&&) noexcept;
  viewer& operator=(viewer&&) = delete;
  ~viewer();

  /// Whether somebody may be looking. If not, frames need not be handed over.
  [[nodiscard]] bool is_open() const;
  /// Takes a frame over. For one thread.
  void show(handed_frame frame);

  /// As long as this lives, the viewer's thread asks the sources; in the end once more.
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
  /// With `--viewer-hold`, waits until the user has closed the viewer or pressed Ctrl-C. Tells why the viewer ended if
  /// it did so on its own.
  void finish(const settings& s, console& console);

 private:
  struct state;
  explicit viewer(std::unique_ptr<state> s);
  std::unique_ptr<state> state_;  // null: nothing is shown
};

}  // namespace app
