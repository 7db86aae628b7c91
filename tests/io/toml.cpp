// SPDX-License-Identifier: BSD-3-Clause
#include <string>

#include <orbis/io/toml.hpp>

#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

namespace io = orbis::io;

TEST_CASE("settings are read with their tables") {
  const orbis::test::temporary_folder folder;
  const auto file = folder.write("a.toml",
                                 "\xEF\xBB\xBF"
                                 "a = 1\n[ b.\"c d\" ]\nx = [1,\n  2]\n\t[[e]]\r\n[[ e ]]\n[-1]\n");
  const auto table = io::read_toml(file).value();
  CHECK(table["a"].value<int>() == 1);
  CHECK(table["b"]["c d"]["x"][1].value<int>() == 2);
  CHECK(table["e"].as_array()->size() == 2);
  CHECK(io::parse_toml("").value().empty());
}

TEST_CASE("what is no TOML is refused with its place and ends no program") {
  const auto message = [](const std::string& text) { return io::parse_toml(text, "f.toml").error().to_string(); };
  CHECK(message("a = 1\nb = = 2\n").starts_with("f.toml:2: not TOML: "));
  CHECK(message("# gr\xfcn\n") == "f.toml: not TOML: not UTF-8");
  for (const std::string head : {"[", "[[", "[]", "[=", "[ \t=1]", "[[ ]]", "[\n]", "[[[a]]]", "[.a]", "[\xc3\xa9]"})
    CHECK(message("a = 1\n " + head + "\nb = 1") == "f.toml: not TOML: a table without a name");
}

TEST_CASE("a date is followed by a time or by the end of the value") {
  for (const char* text :
       {"d = 1979-05-27", "d = 1979-05-27\n", "d = 1979-05-27 # day", "d = [1979-05-27,1979-05-28 ]",
        "d = 1979-05-27T07:32:00", "d = 1979-05-27 07:32:00", "d = \"1979-05-27T[\"", "# 1979-05-27T["}) {
    INFO(text);
    CHECK(io::parse_toml(text));
  }
  for (const char* text : {"d = 1979-05-27T", "d = 1979-05-27T[7:32:00.5", "d = 1979-05-27t\n", "d = 1979-05-27 x"}) {
    INFO(text);
    CHECK(io::parse_toml(text, "a.toml").error().where.starts_with("a.toml"));
  }
}

TEST_CASE("a backslash escapes only characters of ASCII") {
  for (const char* text :
       {"a = \"\"\"x\\\xef\xbb\xbb\"\"\"", "a = \"\"\"x\\ \n \xef\xbb\xbb\"\"\"", "a = \"\\\xc3\xa4\""})
    CHECK_FALSE(io::parse_toml(text).has_value());
  CHECK(io::parse_toml("a = \"\"\"x\\ \n y\xc3\xa4\"\"\"").value()["a"].value<std::string>() == "xy\xc3\xa4");
}

TEST_CASE("strings begin where a key or a value does") {
  for (const char* text : {"a = 0'b\xef\xb5\xbf.", "a = 0.'b\xef\xb5\xbf", "a = 1\"\"", "a\"b\" = 1"})
    CHECK_FALSE(io::parse_toml(text).has_value());
  for (const char* text :
       {"'a' = 'b'", "a.'b'.\"c\" = [\"d\",'e']", "a = {'b' = \"c\"}", "a = \"\"", "a = \"\"\"\"\"\""})
    CHECK(io::parse_toml(text));
}

TEST_CASE("brackets match") {
  for (const char* text : {"a = [[1], {b = [2]}]", "[[a]]\n[a.b]", "a = '}'", "# ]", "a = \"[{\""})
    CHECK(io::parse_toml(text));
  for (const char* text : {"a = [}]1[]]", "a = }", "a = [{b = 1]}", "]", "a = [1", "a = [{}"})
    CHECK_FALSE(io::parse_toml(text).has_value());
}

TEST_CASE("letters beyond ASCII stand in strings and comments only") {
  const auto message = [](const std::string& text) { return io::parse_toml(text, "f.toml").error().to_string(); };
  for (const std::string bad : {R"(ä = 1)", "a\xef\xbb\x81 = 1", R"(a = ä)", "a = 1 \xc2\xa0", R"(a = '#' ä)",
                                R"(a = "\"" ä)", R"(a = ""ä"")", R"(a = '''x'''''ä)", "a = 1 # b\nä = 2"})
    CHECK(message(bad) == "f.toml: not TOML: non-ASCII characters need quotes");
  for (const std::string good : {R"(# ä)", R"("ä" = 'ä')", R"(a = "\"ä" # ä)", R"(a = '\' # ä)", R"(a = '' # ä)",
                                 "a = \"\"\"ä\nä\"\"ä\"\"\"\"\" # '", "a = '''ä\n'ä'''\nb = 'ä'"})
    CHECK(io::parse_toml(good));
  CHECK(io::parse_toml("a = \"ä\"").value()["a"].value<std::string>() == "ä");
}

TEST_CASE("a file of settings has an end") {
  const orbis::test::temporary_folder folder;
  const std::string largest = "#" + std::string(io::max_toml_bytes - 1, '.');
  CHECK(io::read_toml(folder.write("a.toml", largest)));
  const auto more = io::read_toml(folder.write("b.toml", largest + "."));
  CHECK(more.error().code == orbis::errc::malformed);
  CHECK(io::parse_toml(largest + ".").error().to_string() == "is too large for a settings file");
}
