#include <gtest/gtest.h>

#include <string>

#include "client/console/access/metadata_value.h"
#include "client/console/daemon/caller.h"

namespace hapticd::console {
namespace {

TEST(Caller, KnowsTheFormOfAToken) {
  EXPECT_TRUE(is_token("0123456789abcdef0123456789abcdef"));
  for (const char* text : {"", "0123456789abcdef0123456789abcde", "0123456789abcdef0123456789abcdef0",
                           "0123456789ABCDEF0123456789abcdef", "0123456789abcdef0123456789abcde\xfc",
                           "0123456789abcdef 123456789abcdef"}) {
    EXPECT_FALSE(is_token(text)) << text;
  }
}

TEST(MetadataValue, IsPrintableAscii) {
  EXPECT_TRUE(is_metadata_value(""));
  EXPECT_TRUE(is_metadata_value("spiffe://lab/hapticd/operator/anna b~"));
  for (const std::string& text : {std::string("\xfc"), std::string("a\nb"), std::string("a\0b", 3),
                                  std::string("\x7f"), std::string(2000, 'a')}) {
    EXPECT_FALSE(is_metadata_value(text));
  }
}

}  // namespace
}  // namespace hapticd::console
