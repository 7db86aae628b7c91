// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// `camera.toml`: a file with the settings of an RGB-D camera.
///
/// @code
///   model = "radtan"      # pinhole | radtan | kannala_brandt
///   width = 640
///   height = 480
///   fx = 517.3
///   fy = 516.5
///   cx = 318.6
///   cy = 255.3
///   distortion = [0.2624, -0.9531, -0.0054, 0.0026, 1.1633]  # radtan: k1 k2 p1 p2 [k3 [k4 k5 k6]]
///   depth_scale = 5000.0  # stored value / depth_scale = metres; default 1000
///   fps = 30.0            # default 30
///   baseline = 0.075      # metres, optional
///   read_out_ms = 30.0    # rolling-shutter readout time, top row first, optional; 0: global shutter
///   depth_read_out_ms = 30.0  # readout time of the depth image, if different
/// depth_delay_ms = 0.0  # delay of depth after colour, in addition to the difference between their time stamps, if
/// known
/// @endcode
#pragma once

#include <filesystem>
#include <string_view>

#include <orbis/camera/settings.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/result.hpp>

namespace orbis::io {

/// The camera described by `text` in TOML. `where` names the source in errors. Errors: malformed, naming the field
/// (missing, of the wrong type, NaN, out of range, a distortion list whose length does not fit the model, an unknown
/// key; more than `max_toml_bytes`); unsupported (an unknown model).
ORBIS_LAZY [[nodiscard]] result<camera::camera_settings> parse_camera(std::string_view text,
                                                                      const std::filesystem::path& where = {});

/// Reads a camera file; see `parse_camera`. Errors: not_found, unreadable, malformed, unsupported.
ORBIS_LAZY [[nodiscard]] result<camera::camera_settings> read_camera(const std::filesystem::path& path);

/// Writes a camera file atomically. Reading the file returns exactly the same settings (shutter times up to rounding).
/// Errors: write_failed.
ORBIS_LAZY result<void> write_camera(const std::filesystem::path& path, const camera::camera_settings& settings);

}  // namespace orbis::io

#ifndef ORBIS_COMPILED
#include <orbis/io/camera_file-inl.hpp>
#endif
