#include "client/cli/text/utf8_check.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string_view>

#include "client/cli/session/session.h"
#include "proto/text/utf8_text.h"

namespace hapticd::cli {
namespace {

/// Text in UTF-16 has a mark at its beginning, or a NUL in each ASCII character.
bool is_utf16(std::string_view text) {
  return text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF") ||
         text.find('\0') != std::string_view::npos;
}

}  // namespace

void require_utf8(const std::string& text, const std::string& source) {
  if (is_utf16(text)) {
    throw LocalError("this is UTF-16, not UTF-8", source + ", line 1", "", "text in UTF-8",
                     "save it as UTF-8, e.g. iconv -f UTF-16 -t UTF-8", v1::ERROR_REASON_INVALID);
  }
  if (text::is_utf8(text)) return;
  int line = 0;
  std::string_view rest = text;
  std::string_view wrong;
  do {
    const std::size_t end = rest.find('\n');
    wrong = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    ++line;
  } while (text::is_utf8(wrong));
  constexpr std::size_t kShown = 60;
  throw LocalError("this is not UTF-8", fmt::format("{}, line {}", source, line),
                   text::shortened(text::repaired_utf8(wrong), kShown), "text in UTF-8",
                   "save it as UTF-8, e.g. iconv -f LATIN1 -t UTF-8", v1::ERROR_REASON_INVALID);
}

void require_utf8_options(CLI::App& app) {
  const CLI::Validator is_utf8(
      [](const std::string& value) {
        std::error_code ignored;
        const bool may_be = text::is_utf8(value) || std::filesystem::exists(value, ignored);
        return may_be ? std::string() : std::string("not UTF-8");
      },
      "");
  for (CLI::Option* option : app.get_options()) {
    const bool takes_text = option->get_expected_max() > 0;
    if (takes_text && option->get_name() != "PROGRAM") option->check(is_utf8);
  }
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    require_utf8_options(*command);
}

}  // namespace hapticd::cli
