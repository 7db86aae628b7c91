// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/io/mono_recording-inl.hpp>
#include <orbis/io/recording-inl.hpp>
#include <orbis/io/stereo_recording-inl.hpp>
