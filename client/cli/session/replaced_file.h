#pragma once

#include <string>
#include <string_view>

namespace hapticd::cli {

/// True if a file is there that is about to be replaced. Ask before it is written.
bool is_replaced(const std::string& path);
/// End of the line that names a file that was written.
std::string_view replaced_words(bool replaces);

}  // namespace hapticd::cli
