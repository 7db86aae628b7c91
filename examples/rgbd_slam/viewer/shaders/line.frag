// SPDX-License-Identifier: BSD-3-Clause
in vec4 shade;
out vec4 pixel;

void main() { pixel = shade; }
