// SPDX-License-Identifier: MIT
// A single subject: -DSUBJECT=Handheld.

#include "subjects.hpp"

namespace subjects {

template <class Subject, class Result, class... Values>
Result Entry<Subject, Result(Values...)>::feed(Values... values) {
  return Subject::take(values...);
}
template struct Entry<SUBJECT>;

}  // namespace subjects
