#include "client/console/page_files.h"

#include <gtest/gtest.h>

#include <string>

namespace hapticd::console {
namespace {

TEST(PageFiles, AreFoundByTheirPaths) {
  ASSERT_NE(page_file_at("/"), nullptr);
  EXPECT_EQ(page_file_at("/")->name, "console.html");
  EXPECT_NE(page_file_at("/api.js"), nullptr);
  for (const char* path : {"", "/nothing", "/../daemon.cpp", "//api.js", "/api.js/"}) {
    EXPECT_EQ(page_file_at(path), nullptr) << path;
  }
}

TEST(PageFiles, AreSmallTogether) {
  std::size_t bytes = 0;
  for (const PageFile& file : page_files()) bytes += file.text.size();
  EXPECT_LE(bytes, 150'000U);
}

// The policy of the page forbids what is not one of its own files.
TEST(PageFiles, LoadNothingFromElsewhereAndHaveNoInlineCode) {
  for (const PageFile& file : page_files()) {
    const std::string text(file.text);
    EXPECT_EQ(text.find("src=\"http"), std::string::npos) << file.name;
    EXPECT_EQ(text.find("@import"), std::string::npos) << file.name;
    EXPECT_EQ(text.find("import('http"), std::string::npos) << file.name;
    EXPECT_EQ(text.find("innerHTML"), std::string::npos) << file.name;
    EXPECT_EQ(text.find("eval("), std::string::npos) << file.name;
    if (!file.name.ends_with(".html")) continue;
    EXPECT_EQ(text.find("<style"), std::string::npos) << file.name;
    EXPECT_EQ(text.find(" onclick="), std::string::npos) << file.name;
  }
}

}  // namespace
}  // namespace hapticd::console
