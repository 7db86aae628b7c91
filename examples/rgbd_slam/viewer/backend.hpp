// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Back ends that draw the scene in a window or in a browser.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include <orbis/core/result.hpp>

#include "viewer/scene.hpp"

namespace app {

/// Draws scenes. The viewer's thread creates the back end and makes all calls to it.
class viewer_backend {
 public:
  virtual ~viewer_backend() = default;
  /// Draws the scene and handles user input; returns false if the user closed the viewer. Rethrows exceptions of the
  /// back end's threads.
  [[nodiscard]] virtual bool draw(const viewer_scene& scene) = 0;
  /// The address of the viewer, for the user; may be empty.
  [[nodiscard]] virtual std::string where() const = 0;
  /// The minimum time between two calls to `draw`.
  [[nodiscard]] virtual std::chrono::milliseconds interval() const = 0;
};

/// Returns true if the program was built with the library that the back end needs; `name`: "window" or "web".
[[nodiscard]] bool has_viewer(const std::string& name);
/// The error message for a back end that this build does not include, with build instructions.
[[nodiscard]] std::string missing_viewer_message(const std::string& name);

/// Opens a window. Errors: no display, or no OpenGL 3.3.
[[nodiscard]] orbis::result<std::unique_ptr<viewer_backend>> open_window();
/// Serves a page on 127.0.0.1 (`port` 0: any free port). Errors: the port is in use.
[[nodiscard]] orbis::result<std::unique_ptr<viewer_backend>> open_web(unsigned port);

}  // namespace app
