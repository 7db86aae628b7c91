// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/orbis.hpp>

#include "everything.hpp"

int second();

int main() { return orbis::seq.threads() == 1 && second() == 1 ? 0 : 1; }
