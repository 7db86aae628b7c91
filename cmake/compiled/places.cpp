// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/places/detail/compiled/default_vocabulary_functions.hpp>
