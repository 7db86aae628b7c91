// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/mapping/depth_store-inl.hpp>
