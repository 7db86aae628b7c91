// SPDX-License-Identifier: BSD-3-Clause
// Each instance is a line with a width in pixels: two triangles with 6 vertices, without a vertex buffer.
layout(location = 0) in vec3 from;   // metres
layout(location = 1) in vec3 to;
layout(location = 2) in vec4 color;  // 0 ... 1
uniform mat4 clip_from_world;
uniform vec2 viewport;  // pixels
uniform float width;    // pixels
uniform float opacity;
out vec4 shade;

void main() {
  vec4 a = clip_from_world * vec4(from, 1.0);
  vec4 b = clip_from_world * vec4(to, 1.0);
  shade = vec4(color.rgb, color.a * opacity);
  const float least = 0.01;  // clips the part of the line behind the camera, which has no projection
  if (a.w < least && b.w < least) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
  if (a.w < least) a = mix(a, b, (least - a.w) / (b.w - a.w));
  if (b.w < least) b = mix(b, a, (least - b.w) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * viewport;
  along = dot(along, along) < 1e-12 ? vec2(1.0, 0.0) : normalize(along);
  vec2 aside = vec2(-along.y, along.x) * width / viewport;
  bool at_end = gl_VertexID == 1 || gl_VertexID == 2 || gl_VertexID == 4;
  float side = (gl_VertexID == 2 || gl_VertexID == 4 || gl_VertexID == 5) ? 1.0 : -1.0;
  vec4 p = at_end ? b : a;
  gl_Position = p + vec4(side * aside * p.w, 0.0, 0.0);
}
