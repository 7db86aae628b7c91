// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/io/cloud_fields.hpp>
#include <orbis/io/cloud_file.hpp>
#include <orbis/io/pcd.hpp>
#include <orbis/io/ply.hpp>

#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

namespace io = orbis::io;
using io::scalar_type;
using orbis::rgb8;

namespace {

// A writer of its own: a table of numbers to each format and encoding.

struct column {
  std::string name;
  scalar_type type = scalar_type::float32;
  std::size_t count = 1;       // numbers for each point
  std::vector<double> values;  // count for each point
  bool is_list = false;        // in a PLY only
};

struct table {
  std::size_t points = 0;
  std::vector<column> columns;
  bool other_elements = false;  // in a PLY only
  std::string viewpoint = "0 0 0 1 0 0 0";
};

template <class T>
std::string bytes_of(double value, bool big) {
  const T number = static_cast<T>(value);
  std::string bytes(sizeof number, '\0');
  std::memcpy(bytes.data(), &number, sizeof number);
  if (big) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

std::string encode(double value, scalar_type type, bool big = false) {
  switch (type) {
    case scalar_type::int8: return bytes_of<std::int8_t>(value, big);
    case scalar_type::uint8: return bytes_of<std::uint8_t>(value, big);
    case scalar_type::int16: return bytes_of<std::int16_t>(value, big);
    case scalar_type::uint16: return bytes_of<std::uint16_t>(value, big);
    case scalar_type::int32: return bytes_of<std::int32_t>(value, big);
    case scalar_type::uint32: return bytes_of<std::uint32_t>(value, big);
    case scalar_type::int64: return bytes_of<std::int64_t>(value, big);
    case scalar_type::uint64: return bytes_of<std::uint64_t>(value, big);
    case scalar_type::float32: return bytes_of<float>(value, big);
    case scalar_type::float64: return bytes_of<double>(value, big);
  }
  return {};
}

std::string text_of(double value, scalar_type type) {
  char text[64];
  std::snprintf(text, sizeof text, type == scalar_type::float32 ? "%.9g" : "%.17g", value);
  return text;
}

std::string number(double value, scalar_type type, const std::string& encoding) {
  return encoding == "ascii" ? text_of(value, type) + " " : encode(value, type, encoding == "binary_big_endian");
}

std::string ply_of(const table& t, const std::string& encoding) {
  constexpr const char* names[] = {"char", "uchar", "int16", "ushort", "int", "uint32", "", "", "float", "double"};
  const auto type = [&](const column& c) { return std::string{names[static_cast<int>(c.type)]}; };
  std::string bytes = "ply\nformat " + encoding + " 1.0\ncomment any layout\n";
  if (t.other_elements) bytes += "element sensor 2\nproperty list uchar double place\nproperty short id\n";
  bytes += "element vertex " + std::to_string(t.points) + "\n";
  for (const column& c : t.columns)
    bytes += "property " + (c.is_list ? "list uchar " + type(c) : type(c)) + " " + c.name + "\n";
  if (t.other_elements) bytes += "element face 1\nproperty list uchar int vertex_indices\n";
  bytes += "end_header\n";
  const std::string end = encoding == "ascii" ? "\n" : "";
  const auto put = [&](double v, scalar_type as) { bytes += number(v, as, encoding); };
  for (int i = 0; t.other_elements && i != 2; ++i) {
    put(2, scalar_type::uint8), put(0.5, scalar_type::float64), put(-1, scalar_type::float64);
    put(i, scalar_type::int16), bytes += end;
  }
  for (std::size_t i = 0; i != t.points; ++i, bytes += end)
    for (const column& c : t.columns) {
      if (c.is_list) put(static_cast<double>(c.count), scalar_type::uint8);
      for (std::size_t e = 0; e != c.count; ++e) put(c.values[i * c.count + e], c.type);
    }
  if (t.other_elements) put(1, scalar_type::uint8), put(0, scalar_type::int32), bytes += end;
  return bytes;
}

std::string pcd_of(const table& t, const std::string& encoding) {
  std::string fields = "FIELDS", sizes = "SIZE", types = "TYPE", counts = "COUNT", body;
  for (const column& c : t.columns) {
    fields += " " + c.name;
    sizes += " " + std::to_string(encode(0, c.type).size());
    types += c.type >= scalar_type::float32 ? " F" : static_cast<int>(c.type) % 2 == 0 ? " I" : " U";
    counts += " " + std::to_string(c.count);
  }
  const bool by_column = encoding == "binary_compressed";
  if (by_column) {
    for (const column& c : t.columns)
      for (const double v : c.values) body += encode(v, c.type);
    std::string packed;  // literals only
    for (std::size_t i = 0; i < body.size(); i += 32) {
      const std::string some = body.substr(i, 32);
      packed += static_cast<char>(some.size() - 1) + some;
    }
    body = encode(static_cast<double>(packed.size()), scalar_type::uint32) +
           encode(static_cast<double>(body.size()), scalar_type::uint32) + packed;
  } else {
    for (std::size_t i = 0; i != t.points; ++i, body += encoding == "ascii" ? "\n" : "")
      for (const column& c : t.columns)
        for (std::size_t e = 0; e != c.count; ++e) body += number(c.values[i * c.count + e], c.type, encoding);
  }
  const std::string n = std::to_string(t.points);
  return "# .PCD v0.7\nVERSION 0.7\n" + fields + "\n" + sizes + "\n" + types + "\n" + counts + "\nWIDTH " + n +
         "\nHEIGHT 1\nVIEWPOINT " + t.viewpoint + "\nPOINTS " + n + "\nDATA " + encoding + "\n" + body;
}

struct format {
  bool is_ply;
  std::string encoding;
};
const std::vector<format> formats{
    {true, "ascii"},   {true, "binary_little_endian"}, {true, "binary_big_endian"}, {false, "ascii"},
    {false, "binary"}, {false, "binary_compressed"}};

io::cloud_with_fields parse(const table& t, const format& f) {
  return f.is_ply ? io::parse_ply_with_fields(ply_of(t, f.encoding)).value()
                  : io::parse_pcd_with_fields(pcd_of(t, f.encoding)).value();
}

// Tables with known points and colours.

column column_of(std::string name, scalar_type type, std::vector<double> values) {
  return {std::move(name), type, 1, std::move(values), false};
}

/// Columns in which colours are stored: channels of any name, type and unit, or one packed column.
struct color_kind {
  std::string what;
  std::vector<std::string> names;  // three, or one if packed
  scalar_type type = scalar_type::uint8;
  double unit = 1.0;  // of one 255th
  std::string note{};
};
const std::vector<color_kind> color_kinds{
    {"bytes", {"red", "green", "blue"}},
    {"short names", {"r", "g", "b"}},
    {"upper case", {"Red", "GREEN", "Blue"}},
    {"short names in upper case", {"R", "G", "B"}},
    {"packed, in upper case", {"RGB"}, scalar_type::uint32},
    {"diffuse", {"diffuse_red", "diffuse_green", "diffuse_blue"}},
    {"0 to 1", {"red", "green", "blue"}, scalar_type::float32, 1.0 / 255.0},
    {"0 to 1 as double", {"r", "g", "b"}, scalar_type::float64, 1.0 / 255.0},
    {"0 to 255", {"red", "green", "blue"}, scalar_type::float32, 1.0, "up to 200: interpreted as 0 ... 255"},
    {"0 to 255 as double", {"diffuse_red", "diffuse_green", "diffuse_blue"}, scalar_type::float64, 1.0, "... 255"},
    {"16 bits", {"red", "green", "blue"}, scalar_type::uint16, 257.0},
    {"bytes as 16 bits", {"red", "green", "blue"}, scalar_type::uint16, 1.0, "... 255"},
    {"bytes as int", {"r", "g", "b"}, scalar_type::int32, 1.0, "... 255"},
    {"packed into floats", {"rgb"}, scalar_type::float32},
    {"packed into integers", {"rgb"}, scalar_type::uint32},
    {"packed with alpha", {"rgba"}, scalar_type::uint32},
    {"packed into signed integers", {"rgba"}, scalar_type::int32}};

/// The colours as columns. The greatest channel is 200.
std::vector<column> columns_of(const color_kind& kind, const std::vector<rgb8>& colors) {
  std::vector<column> columns;
  for (const std::string& name : kind.names) columns.push_back(column_of(name, kind.type, {}));
  for (const rgb8& c : colors)
    if (columns.size() == 3) {
      columns[0].values.push_back(c.r * kind.unit);
      columns[1].values.push_back(c.g * kind.unit);
      columns[2].values.push_back(c.b * kind.unit);
    } else {
      const std::uint32_t packed = std::uint32_t{c.r} << 16U | std::uint32_t{c.g} << 8U | std::uint32_t{c.b};
      columns[0].values.push_back(kind.type == scalar_type::float32 ? static_cast<double>(std::bit_cast<float>(packed))
                                                                    : static_cast<double>(packed));
    }
  return columns;
}

std::vector<column> coordinates(std::size_t points) {
  std::vector<column> xyz;
  for (const char* name : {"x", "y", "z"}) {
    xyz.push_back(column_of(name, scalar_type::float32, {}));
    for (std::size_t i = 0; i != points; ++i) xyz.back().values.push_back(static_cast<double>(i) + 0.25);
  }
  return xyz;
}

bool has_note(const io::cloud_with_fields& cloud, const std::string& part) {
  return std::ranges::any_of(cloud.notes, [&](const std::string& note) { return note.find(part) != note.npos; });
}

/// The numbers of a field, as doubles.
std::vector<double> numbers(const io::cloud_field& field) {
  const std::size_t size = encode(0, field.type).size();
  std::vector<double> all;
  for (std::size_t at = 0; at != field.bytes.size(); at += size)
    for (double exact = 0.0; all.size() == at / size; all.push_back(exact)) {
      const auto load = [&](auto v) {
        std::memcpy(&v, field.bytes.data() + at, sizeof v);
        exact = static_cast<double>(v);
      };
      switch (field.type) {
        case scalar_type::int8: load(std::int8_t{}); break;
        case scalar_type::uint8: load(std::uint8_t{}); break;
        case scalar_type::int16: load(std::int16_t{}); break;
        case scalar_type::uint16: load(std::uint16_t{}); break;
        case scalar_type::int32: load(std::int32_t{}); break;
        case scalar_type::uint32: load(std::uint32_t{}); break;
        case scalar_type::int64: load(std::int64_t{}); break;
        case scalar_type::uint64: load(std::uint64_t{}); break;
        case scalar_type::float32: load(float{}); break;
        case scalar_type::float64: load(double{}); break;
      }
    }
  return all;
}

bool same_numbers(const std::vector<double>& a, const std::vector<double>& b) {
  return std::ranges::equal(a, b, [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}

}  // namespace

TEST_CASE("colours of every name, type and unit are read the same from every format") {
  const std::vector<rgb8> colors{{200, 100, 50}, {10, 20, 30}, {0, 199, 128}, {90, 90, 91}, {0, 0, 1}};
  for (const color_kind& kind : color_kinds)
    for (const format& f : formats)
      for (const bool colors_first : {false, true}) {
        INFO(kind.what << ", " << (f.is_ply ? "ply " : "pcd ") << f.encoding);
        table t{.points = colors.size(), .columns = coordinates(colors.size())};
        const auto more = columns_of(kind, colors);
        t.columns.insert(colors_first ? t.columns.begin() : t.columns.end(), more.begin(), more.end());
        const auto read = parse(t, f);
        CHECK(read.cloud.colors == colors);
        CHECK(read.cloud.points.at(1) == orbis::vec3f(1.25F, 1.25F, 1.25F));
        CHECK(read.fields.empty());
        CHECK(read.notes.size() == (kind.note.empty() ? 0U : 1U));
        if (!kind.note.empty()) CHECK(has_note(read, kind.note));
      }
}

TEST_CASE("rounding errors of floating-point colours do not change their range") {
  for (const format& f : formats) {
    table t{.points = 1, .columns = coordinates(1)};
    for (const char* name : {"red", "green", "blue"})
      t.columns.push_back(column_of(name, scalar_type::float32, {1.00001}));
    CHECK(parse(t, f).cloud.colors == std::vector<rgb8>{{255, 255, 255}});
    CHECK(parse(t, f).notes.empty());
  }
}

TEST_CASE("the range of channels follows from the greatest one, and an unusual one is noted") {
  struct kind {
    scalar_type type;
    double greatest;
    double range;        // of the others: white is this value
    std::string note{};  // none: usual
  };
  const std::string floating = "colours are floating-point numbers up to ", whole = "colours are integers up to ";
  const std::vector<kind> kinds{{scalar_type::float32, 1.001, 1.0, floating + "1.001: interpreted as 0 ... 1"},
                                {scalar_type::float32, 1.01, 1.0, floating + "1.01: interpreted as 0 ... 1"},
                                {scalar_type::float64, 2.0, 1.0, floating + "2: interpreted as 0 ... 1"},
                                {scalar_type::float32, 2.5, 255.0, floating + "2.5: interpreted as 0 ... 255"},
                                {scalar_type::float64, 100.25, 255.0, floating + "100.25: interpreted as 0 ... 255"},
                                {scalar_type::float32, 255.0, 255.0, floating + "255: interpreted as 0 ... 255"},
                                {scalar_type::float32, 60000.0, 65535.0, floating + "60000: interpreted as 0 ... 65535"},
                                {scalar_type::uint16, 255.0, 255.0, whole + "255: interpreted as 0 ... 255"},
                                {scalar_type::uint16, 256.0, 4095.0, whole + "256: interpreted as 0 ... 4095"},
                                {scalar_type::uint16, 4095.0, 4095.0, whole + "4095: interpreted as 0 ... 4095"},
                                {scalar_type::uint16, 4096.0, 65535.0, whole + "4096: interpreted as 0 ... 65535"},
                                {scalar_type::uint16, 16383.0, 65535.0, whole + "16383: interpreted as 0 ... 65535"},
                                {scalar_type::uint16, 16384.0, 65535.0},
                                {scalar_type::int32, 16384.0, 65535.0, whole + "16384: interpreted as 0 ... 65535"}};
  for (const kind& k : kinds)
    for (const format& f : formats) {
      INFO(k.greatest << ", " << f.encoding);
      const double other =
          k.type >= scalar_type::float32 ? 0.75 * std::min(k.range, k.greatest) : std::floor(k.greatest / 2);
      table t{.points = 2, .columns = coordinates(2)};
      t.columns.push_back(column_of("red", k.type, {k.greatest, 0}));
      t.columns.push_back(column_of("green", k.type, {other, 0}));
      t.columns.push_back(column_of("blue", k.type, {0, 0}));
      const auto byte = [&](double v) {
        return static_cast<std::uint8_t>(std::round(255 * std::min(1.0, v / k.range)));
      };
      const auto read = parse(t, f);
      CHECK(read.cloud.colors == std::vector<rgb8>{{byte(k.greatest), byte(other), 0}, {}});
      CHECK(read.notes == (k.note.empty() ? std::vector<std::string>{} : std::vector{k.note}));
    }
}

TEST_CASE("whole numbers in a text column of floats are packed integers") {
  const std::string head = "FIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nWIDTH 3\nDATA ascii\n";
  const std::vector<rgb8> colors{{255, 0, 0}, {1, 2, 3}, {0, 0, 255}};
  const auto red = [](const char* a, const char* b, const char* c) {
    return "0 0 1 " + std::string{a} + "\n0 1 1 " + b + "\n1 1 1 " + c + "\n";
  };
  for (const std::string& body :
       {red("16711680", "66051", "255"), red("16711680.0", "66051", "2.55e2"),
        red("4294901760", "4278256131", "4278190335"), red("-65536", "-16711165", "-16776961")}) {
    INFO(body);
    const auto read = io::parse_pcd_with_fields(head + body).value();
    CHECK(read.cloud.colors == colors);
    CHECK(read.fields.empty());
    CHECK(read.notes == std::vector<std::string>{
                            "rgb is declared as floating-point, but has whole numbers: read as packed integers"});
  }
  const auto bits = io::parse_pcd_with_fields(head + red("2.34180515e-38", "9.25571648e-41", "0")).value();
  CHECK(bits.cloud.colors == std::vector<rgb8>{{255, 0, 0}, {1, 2, 3}, {0, 0, 0}});
  CHECK(bits.notes.empty());
  CHECK(io::parse_pcd_with_fields(head + red("0", "0", "0")).value().notes.empty());
}

TEST_CASE("alpha that varies becomes a field, and constant alpha is none") {
  for (const format& f : formats) {
    table t{.points = 2, .columns = coordinates(2)};
    t.columns.push_back(column_of("rgba", scalar_type::uint32, {0xFF010203U, 0xFF040506U}));
    CHECK(parse(t, f).fields.empty());
    t.columns.back().values[1] = 0x80040506U;
    const auto read = parse(t, f);
    CHECK(read.cloud.colors == std::vector<rgb8>{{1, 2, 3}, {4, 5, 6}});
    REQUIRE(read.fields.size() == 1);
    CHECK(read.fields[0].name == "alpha");
    CHECK(numbers(read.fields[0]) == std::vector<double>{255, 128});
  }
}

TEST_CASE("numbers beyond the declared type survive in text") {
  for (const format& f : formats)
    if (f.encoding == "ascii") {
      table t{.points = 3, .columns = coordinates(3)};
      t.columns.push_back(column_of("label", scalar_type::uint8, {7, -1, 300}));
      t.columns.push_back(column_of("gain", scalar_type::int16, {7, 0.5, NAN}));
      t.columns.push_back(column_of("time", scalar_type::float32, {7, 16777216, 123456789}));
      const auto read = parse(t, f);
      REQUIRE(read.fields.size() == 3);
      CHECK(numbers(read.fields[2]) == std::vector<double>{7, 16777216, 123456789});
      CHECK(numbers(read.fields[0]) == std::vector<double>{7, -1, 300});
      CHECK(same_numbers(numbers(read.fields[1]), {7, 0.5, NAN}));
    }
}

TEST_CASE("coordinates may have names in upper case, but names in lower case come first") {
  for (const format& f : formats) {
    table t{.points = 2, .columns = coordinates(2)};
    for (column& c : t.columns) c.name[0] = static_cast<char>(c.name[0] - 'a' + 'A');
    CHECK(parse(t, f).cloud.points.at(1) == orbis::vec3f(1.25F, 1.25F, 1.25F));
    CHECK(parse(t, f).notes.empty());
    t.columns.push_back(column_of("x", scalar_type::float32, {8, 9}));
    const auto read = parse(t, f);
    CHECK(read.cloud.points.at(1) == orbis::vec3f(9, 1.25F, 1.25F));
    CHECK(io::field_names(read.fields) == "X");
  }
}

TEST_CASE("what a cloud leaves out is noted") {
  table t{.points = 2, .columns = coordinates(2), .other_elements = true};
  t.columns.push_back({"neighbors", scalar_type::int32, 3, std::vector<double>(6, 1.0), true});
  t.columns.push_back(column_of("x", scalar_type::float32, {8, 9}));
  t.columns.push_back(column_of("intensity", scalar_type::float32, {8, 9}));
  const auto ply = parse(t, formats[0]);
  CHECK(ply.notes ==
        std::vector<std::string>{"left out: element sensor (2), list neighbors, element face (1), repeated x"});
  CHECK(io::field_names(ply.fields) == "intensity");

  const std::string words =
      "FIELDS x y z label n\nSIZE 4 4 4 4 4\nTYPE F F F F F\nWIDTH 2\nDATA ascii\n1 2 3 4 5\n6 7 8 wall 9\n";
  const auto read = io::parse_pcd_with_fields(words).value();
  CHECK(read.cloud.points.at(1).z() == 8.0F);
  CHECK(read.notes == std::vector<std::string>{"left out: label (no number in line 7)"});
  CHECK(io::field_names(read.fields) == "n");

  t = {.points = 1, .columns = coordinates(1)};
  CHECK(parse(t, formats[3]).notes.empty());
  t.columns.push_back(column_of("red", scalar_type::uint8, {1}));
  t.columns.push_back(column_of("gren", scalar_type::uint8, {2}));
  t.columns.push_back(column_of("blue", scalar_type::uint8, {3}));
  for (const format& f : formats) {
    const auto read = parse(t, f);
    CHECK_FALSE(read.cloud.has_colors());
    CHECK(has_note(read, "no colours: green is missing"));
    CHECK(io::field_names(read.fields) == "red, gren, blue");
    table packed = t;
    packed.columns.push_back(column_of("rgb", scalar_type::uint32, {0x010203}));
    CHECK(parse(packed, f).cloud.colors == std::vector<rgb8>{{1, 2, 3}});
    CHECK_FALSE(has_note(parse(packed, f), "no colours"));
    packed.columns.back() = column_of("rgb", scalar_type::float64, {0.5});
    CHECK(has_note(parse(packed, f), "no colours: rgb does not contain packed colours"));
  }
}

TEST_CASE("a viewpoint other than the identity is noted and survives a PCD") {
  const orbis::test::temporary_folder folder;
  table t{.points = 1, .columns = coordinates(1)};
  for (const char* same : {"0 0 0 1 0 0 0", "0 0 0 -1 0 0 0", "0.0 -0.0 0 1 0 0 0", "0 0 0 0 0 0 0"}) {
    t.viewpoint = same;
    CHECK(parse(t, formats[4]).notes.empty());
  }
  for (const char* other : {"0 -1 0 0.7071068 0.7071068 0 0", "0 0 0 0 1 0 0", "1e-3 0 0 1 0 0 0"}) {
    t.viewpoint = other;
    const auto read = parse(t, formats[4]);
    CHECK(has_note(read, std::string{"VIEWPOINT "} + other + " is not applied"));
    const std::vector<std::uint32_t> all{0};
    REQUIRE(io::write_cloud(folder / "a.pcd", read, all));
    CHECK(io::read_cloud_with_fields(folder / "a.pcd").value().viewpoint == read.viewpoint);
    REQUIRE(io::write_cloud(folder / "a.ply", read, all));
    CHECK(io::read_cloud_with_fields(folder / "a.ply").value().notes.empty());
  }
  for (const char* bad : {"", "1 2 3", "0 0 0 1 0 0 nan", "a b c d e f g"}) {
    t.viewpoint = bad;
    CHECK(has_note(parse(t, formats[3]), "is not seven numbers"));
  }
}

TEST_CASE("clouds of random layouts are read exactly and survive writing") {
  const orbis::test::temporary_folder folder;
  constexpr double lowest[] = {-128, 0, -32768, 0, -2147483648.0, 0, -9007199254740992.0, 0, -1e6, -1e300};
  constexpr double highest[] = {
      127, 255, 32767, 65535, 2147483647, 4294967295.0, 9007199254740992.0, 9007199254740992.0, 1e6, 1e300};
  for (std::uint64_t seed = 0; seed != 120; ++seed) {
    orbis::random_bits random{seed};
    const format& f = formats[seed % formats.size()];
    const auto any_of = [&](const auto& from) {
      return from[random.below(static_cast<std::uint32_t>(std::size(from)))];
    };
    const auto any_type = [&] {
      for (;;)
        if (const auto type = static_cast<scalar_type>(random.below(10));
            !f.is_ply || (type != scalar_type::int64 && type != scalar_type::uint64))
          return type;
    };
    const auto value_of = [&](scalar_type type) {
      const auto k = static_cast<std::size_t>(type);
      if (type == scalar_type::float32 || type == scalar_type::float64) {
        if (random.below(20) == 0) return static_cast<double>(NAN);
        const double v = random.uniform(lowest[k], 0.0) + random.uniform(0.0, highest[k]);
        return type == scalar_type::float32 ? static_cast<double>(static_cast<float>(v)) : v;
      }
      return std::clamp(std::floor(random.uniform(lowest[k], highest[k] + 1.0)), lowest[k], highest[k]);
    };
    table t{.points = 1 + random.below(40), .columns = {}, .other_elements = random.below(2) == 0};
    const auto filled = [&](std::string name, scalar_type type, std::size_t count) {
      column c{std::move(name), type, count, {}, false};
      for (std::size_t i = 0; i != t.points * count; ++i) c.values.push_back(value_of(type));
      return c;
    };
    for (const char* name : {"x", "y", "z"})
      t.columns.push_back(
          filled(name, any_of(std::array{scalar_type::float32, scalar_type::int16, scalar_type::uint8}), 1));
    std::vector<rgb8> colors;
    if (random.below(4) != 0) {
      for (std::size_t i = 0; i != t.points; ++i) {
        const auto byte = [&] { return static_cast<std::uint8_t>(random.below(201)); };
        colors.push_back({byte(), byte(), byte()});
      }
      colors[0].g = 200;
      for (const column& c : columns_of(any_of(color_kinds), colors)) t.columns.push_back(c);
    }
    const std::vector<std::string> names{"intensity", "nx", "ny", "nz", "ring", "time", "label", "curvature", "alpha"};
    const std::size_t extra = random.below(6), first = random.below(4);
    for (std::size_t k = first; k != first + extra; ++k)
      t.columns.push_back(filled(names[k], any_type(), f.is_ply ? 1 : 1 + random.below(3)));
    if (f.is_ply && random.below(2) == 0) {
      t.columns.push_back(filled("list", any_type(), random.below(3)));
      t.columns.back().is_list = true;
    }
    for (std::size_t i = t.columns.size(); i > 1; --i)
      std::swap(t.columns[i - 1], t.columns[random.below(static_cast<std::uint32_t>(i))]);

    const auto has = [&](const io::cloud_with_fields& cloud, const std::vector<std::uint32_t>& rows) {
      REQUIRE(cloud.cloud.size() == rows.size());
      std::size_t next = 0;
      for (const column& c : t.columns) {
        const int axis = c.name == "x" ? 0 : c.name == "y" ? 1 : c.name == "z" ? 2 : -1;
        for (std::size_t i = 0; axis >= 0 && i != rows.size(); ++i) {
          const double wanted = c.values[rows[i]], is = double{cloud.cloud.points[i][axis]};
          CHECK((is == wanted || (std::isnan(is) && std::isnan(wanted))));
        }
        if (c.is_list || std::ranges::find(names, c.name) == names.end()) continue;
        for (std::size_t e = 0; e != c.count;) {
          REQUIRE(next != cloud.fields.size());
          const io::cloud_field& field = cloud.fields[next++];
          CHECK(field.name.starts_with(c.name));
          std::vector<double> wanted;
          for (const std::uint32_t row : rows)
            for (std::size_t k = e; k != e + field.count; ++k) wanted.push_back(c.values[row * c.count + k]);
          CHECK(same_numbers(numbers(field), wanted));
          e += field.count;
        }
      }
      CHECK(next == cloud.fields.size());
      REQUIRE(cloud.cloud.colors.size() == (colors.empty() ? 0U : rows.size()));
      for (std::size_t i = 0; !colors.empty() && i != rows.size(); ++i) CHECK(cloud.cloud.colors[i] == colors[rows[i]]);
    };
    INFO("seed " << seed << ", " << (f.is_ply ? "ply " : "pcd ") << f.encoding);
    std::vector<std::uint32_t> rows, some;
    for (std::uint32_t i = 0; i != t.points; ++i) {
      rows.push_back(i);
      if (random.below(2) == 0) some.push_back(i);
    }
    const auto read = parse(t, f);
    has(read, rows);
    if (some.empty()) continue;
    for (const char* name : {"out.ply", "out.pcd"}) {
      REQUIRE(io::write_cloud(folder / name, read, some));
      has(io::read_cloud_with_fields(folder / name).value(), some);
    }
    REQUIRE(io::write_ply(folder / "text.ply", read, some, {.encoding = io::ply_encoding::ascii}));
    has(io::read_cloud_with_fields(folder / "text.ply").value(), some);
  }
}

TEST_CASE("the properties of a PLY have different names") {
  const orbis::test::temporary_folder folder;
  table t{.points = 1, .columns = coordinates(1)};
  t.columns.push_back({"f", scalar_type::float32, 2, {1, 2}, false});
  t.columns.push_back(column_of("f_0", scalar_type::float32, {3}));
  t.columns.push_back({"f_2", scalar_type::uint8, 2, {4, 5}, false});
  const std::vector<std::uint32_t> all{0};
  REQUIRE(io::write_cloud(folder / "a.ply", parse(t, formats[4]), all));
  const auto read = io::read_cloud_with_fields(folder / "a.ply").value();
  CHECK(io::field_names(read.fields) == "f_1, f_2, f_0, f_2_0, f_2_1");
  for (std::size_t k = 0; k != 5; ++k) CHECK(numbers(read.fields.at(k)) == std::vector{static_cast<double>(k + 1)});
}

TEST_CASE("fields of a cloud far from the origin survive, and its coordinates stay where they were") {
  const orbis::test::temporary_folder folder;
  const orbis::vec3 origin{455'000.0, 5'430'000.0, 100.0};
  io::cloud_with_fields cloud{.cloud = {{{0.5F, 1.25F, -2.0F}, {1.0F, 2.0F, 3.0F}}, {}},
                              .fields = {{"intensity", scalar_type::uint8, 1, "\x07\xC8"}},
                              .notes = {}};
  for (const char* name : {"far.ply", "far.pcd"}) {
    const std::vector<std::uint32_t> second{1};
    REQUIRE(io::write_cloud(folder / name, cloud, second, origin));
    const auto read = io::read_cloud_with_fields(folder / name, origin).value();
    CHECK(read.cloud.points == std::vector<orbis::vec3f>{{1.0F, 2.0F, 3.0F}});
    REQUIRE(read.fields.size() == 1);
    CHECK(read.fields[0].bytes == "\xC8");
  }
}
