// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How the scene is drawn: in a window, or in a browser.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include <orbis/core/result.hpp>

#include "viewer/scene.hpp"

namespace app {

/// Draws scenes. All calls come from the thread that made it, the viewer's.
class viewer_backend {
 public:
  virtual ~viewer_backend() = default;
  /// Draws, and takes what the user does. False: the user has closed it. Throws what a thread of the back end has
  /// thrown.
  [[nodiscard]] virtual bool draw(const viewer_scene& scene) = 0;
  /// Where it is to be seen, for the user; empty: nothing needs to be said.
  [[nodiscard]] virtual std::string where() const = 0;
  /// The time between two calls of `draw`, at least.
  [[nodiscard]] virtual std::chrono::milliseconds interval() const = 0;
};

/// Whether the program was built with the library that the back end needs; `name`: "window" or "web".
[[nodiscard]] bool has_viewer(const std::string& name);
/// A line that says how to build a program that has it.
[[nodiscard]] std::string how_to_get_viewer(const std::string& name);

/// Opens a window. Errors: there is no display, or it has no OpenGL 3.3.
[[nodiscard]] orbis::result<std::unique_ptr<viewer_backend>> open_window();
/// Serves a page on 127.0.0.1 (`port` 0: any that is free). Errors: the port is taken.
[[nodiscard]] orbis::result<std::unique_ptr<viewer_backend>> open_web(unsigned port);

}  // namespace app
