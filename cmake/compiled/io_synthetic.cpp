// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/io/synthetic-inl.hpp>
