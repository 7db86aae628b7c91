// SPDX-License-Identifier: BSD-3-Clause
// A face with darker edges if it is large enough on the screen.
in vec3 shade;
in vec2 on_face;
out vec4 pixel;

void main() {
  vec2 width = fwidth(on_face);
  vec2 edge = smoothstep(vec2(1.0) - 1.5 * width - 0.04, vec2(1.0) - 0.5 * width, abs(on_face));
  float seen = clamp(1.0 - 6.0 * max(width.x, width.y), 0.0, 1.0);
  pixel = vec4(shade * (1.0 - 0.3 * seen * max(edge.x, edge.y)), 1.0);
}
