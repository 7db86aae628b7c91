// SPDX-License-Identifier: BSD-3-Clause
#define ORBIS_INSTANTIATE_CLOUD template
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/statistical.hpp>
