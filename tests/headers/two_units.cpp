// SPDX-License-Identifier: BSD-3-Clause
extern "C" unsigned first();   // everything.cpp
extern "C" unsigned second();  // the copy of its object

int main() { return first() == 1 && second() == 1 ? 0 : 1; }
