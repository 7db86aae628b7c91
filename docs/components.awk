# SPDX-License-Identifier: BSD-3-Clause
#
# Doxygen's filter of a header: everything that a component declares is in a group with the component's name, whose page
# begins with the text of the umbrella header.
BEGIN {
  path = ARGV[1]
  sub(/.*include\/orbis\//, "", path)
  is_umbrella = path !~ /\//
  component = path
  sub(/[.\/].*/, "", component)
}
is_umbrella && component != "orbis" && !titled && sub(/@file/, "@defgroup " component " " component) { titled = 1 }
!is_umbrella && open && /^}  \/\/ namespace orbis/ { open = 0; print "/// @}" }
{ print }
!is_umbrella && /^namespace orbis[a-z_:]* \{$/ { open = 1; print "/// @addtogroup " component " " component "\n/// @{" }
