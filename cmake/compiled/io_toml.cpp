// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/io/camera_file-inl.hpp>
#include <orbis/io/toml-inl.hpp>
