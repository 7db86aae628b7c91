// SPDX-License-Identifier: BSD-3-Clause
// Each instance is a cube: the three faces towards the camera with 18 vertices, without a vertex buffer.
layout(location = 0) in vec4 cube;   // centre and edge length, metres
layout(location = 1) in vec4 color;  // 0 ... 1
uniform mat4 clip_from_world;
uniform vec3 eye;
uniform vec3 forward;     // viewing direction, unit vector
uniform float nearest;    // cubes nearer than this along `forward` are omitted, metres
uniform float highest;    // cubes above this are omitted, metres
uniform vec2 heights;     // range of the height colours, metres
uniform float by_height;  // 1: coloured by height, 0: by the images
out vec3 shade;
out vec2 on_face;  // -1 ... 1

vec3 color_of_height(float t) {
  t = clamp(t, 0.0, 1.0) * 4.0;
  vec3 a = mix(vec3(0.19, 0.23, 0.60), vec3(0.13, 0.56, 0.78), clamp(t, 0.0, 1.0));
  vec3 b = mix(a, vec3(0.28, 0.75, 0.48), clamp(t - 1.0, 0.0, 1.0));
  vec3 c = mix(b, vec3(0.95, 0.80, 0.29), clamp(t - 2.0, 0.0, 1.0));
  return mix(c, vec3(0.87, 0.35, 0.22), clamp(t - 3.0, 0.0, 1.0));
}

void main() {
  on_face = vec2(0.0);
  shade = vec3(0.0);
  if (dot(cube.xyz - eye, forward) < nearest || cube.z > highest) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);  // outside the view: not drawn
    return;
  }
  int axis = gl_VertexID / 6;
  int k = gl_VertexID - 6 * axis;
  float u = (k == 1 || k == 2 || k == 4) ? 1.0 : -1.0;
  float v = (k == 2 || k == 4 || k == 5) ? 1.0 : -1.0;
  vec3 to_eye = eye - cube.xyz;
  vec3 corner;
  if (axis == 0)
    corner = vec3(sign(to_eye.x), u, v);
  else if (axis == 1)
    corner = vec3(u, sign(to_eye.y), v);
  else
    corner = vec3(u, v, sign(to_eye.z));
  float light = axis == 0 ? 0.84 : axis == 1 ? 0.70 : to_eye.z > 0.0 ? 1.0 : 0.55;
  shade = light * mix(color.rgb, color_of_height((cube.z - heights.x) / (heights.y - heights.x)), by_height);
  on_face = vec2(u, v);
  gl_Position = clip_from_world * vec4(cube.xyz + 0.5 * cube.w * corner, 1.0);
}
