#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# includes.sh INCLUDE_DIR: checks that every header includes the standard headers that it uses. (Compiling each header
# separately checks the includes of the project, but uses precompiled standard headers for speed.)
# x-inl.hpp includes x.hpp and relies on its includes.
set -euo pipefail
cd "$1"
status=0
uses() {  # header, names that it provides
  local file
  while IFS= read -r file; do
    [[ $file == *-inl.hpp ]] && grep -q "#include <$1>" "${file/-inl/}" && continue
    echo "$file uses std::$2 and does not include <$1>"
    status=1
  done < <(grep -rlE "^[^/]*\bstd::($2)\b" --include='*.hpp' orbis | xargs -r grep -LE "#include <$1>" | sort)
}
uses vector 'vector'
uses array 'array'
uses span 'span'
uses string '(to_)?string'
uses string_view 'string_view'
uses optional 'optional|nullopt'
uses variant 'variant|visit|get_if|holds_alternative'
uses map 'map|multimap'
uses unordered_map 'unordered_map'
uses set 'set'
uses deque 'deque'
uses memory 'unique_ptr|shared_ptr|make_unique|make_shared|weak_ptr|addressof'
uses functional 'function|reference_wrapper'
uses thread 'j?thread'
uses atomic 'atomic'
uses mutex 'mutex|lock_guard|scoped_lock|unique_lock'
uses filesystem 'filesystem'
uses system_error 'error_code|system_error'
uses fstream '[io]?fstream'
uses sstream '[io]?stringstream'
uses numeric 'accumulate|iota|partial_sum|inclusive_scan'
uses algorithm '(stable_|partial_)?sort|nth_element|min|max|clamp|fill|fill_n|copy|copy_n|all_of|any_of|none_of|find|find_if|lower_bound|upper_bound|min_element|max_element|transform|reverse|unique|count_if'
uses cmath 'sqrt|abs|pow|exp|log|log1p|expm1|sin|cos|tan|atan2|acos|asin|hypot|floor|ceil|round|lround|isfinite|isnan|isinf|copysign|fma|cbrt'
uses limits 'numeric_limits'
uses bit 'bit_cast|popcount|countr_zero|countl_zero|bit_ceil|bit_width|has_single_bit|rotl|endian'
uses tuple 'tuple|tie|make_tuple|apply'
uses chrono 'chrono'
uses ranges 'ranges::([a-z_]*range[a-z_]*|size|data|begin|end|iterator_t)'
uses cstring 'memcpy|memset|memcmp|memmove'
uses charconv 'from_chars|to_chars'
uses exception 'exception_ptr|current_exception|rethrow_exception'
exit $status
