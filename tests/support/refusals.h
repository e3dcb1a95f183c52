#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "hal/error.h"

namespace hapticd::test {

/// A text that a reader of files refuses.
struct RefusedText {
  std::string text;
  std::string key;  ///< what the refusal names, e.g. the key
  hal::ErrorCode code;
  int line = 0;            ///< of the text, as the refusal says; 0: it says none
  std::string limit = {};  ///< part of what would be accepted
};

/// Expects of every text that `read`, which returns a hal::Result, refuses it with that key and code.
template <class Read>
void expect_refusals(const std::vector<RefusedText>& texts, Read read) {
  for (const RefusedText& one : texts) {
    SCOPED_TRACE(one.text.substr(0, 500));
    const auto result = read(one.text);
    if (result) {
      ADD_FAILURE() << "it is accepted";
      continue;
    }
    const hal::Error& error = result.error();
    EXPECT_EQ(static_cast<int>(error.code), static_cast<int>(one.code)) << error.text();
    EXPECT_NE((error.where + ": " + error.what).find(one.key), std::string::npos) << error.text();
    EXPECT_NE(error.limit.find(one.limit), std::string::npos) << error.text();
    if (one.line != 0) {
      const std::string place = ", line " + std::to_string(one.line);
      EXPECT_TRUE(error.where.ends_with(place)) << error.text() << "; expected" << place;
    }
  }
}

/// The five texts and the code.
inline void expect_same(const hal::Error& error, const hal::Error& expected) {
  EXPECT_EQ(error.what, expected.what);
  EXPECT_EQ(error.where, expected.where);
  EXPECT_EQ(error.value, expected.value);
  EXPECT_EQ(error.limit, expected.limit);
  EXPECT_EQ(error.remedy, expected.remedy);
  EXPECT_EQ(static_cast<int>(error.code), static_cast<int>(expected.code));
}

}  // namespace hapticd::test
