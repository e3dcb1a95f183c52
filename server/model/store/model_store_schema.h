#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "hal/error.h"

namespace SQLite {
class Database;
}

namespace hapticd::server::store_schema {

inline constexpr std::int32_t kApplicationId = 0x68707464;  ///< "hptd", in the file's header
inline constexpr int kVersion = 3;

/// Looks at the first bytes of a file. Nothing when it may be opened, else why it is not a store of ours. A
/// file that is empty or does not exist may be opened.
std::optional<hal::Error> check_header(const std::string& path);

/// Checks an open database, including its journal. Throws SQLite::Exception.
std::optional<hal::Error> check(SQLite::Database& database, const std::string& path);

/// Brings an open database to kVersion, all steps or none. Another process may do the same at the same time.
/// Throws SQLite::Exception.
std::optional<hal::Error> migrate(SQLite::Database& database, const std::string& path);

}  // namespace hapticd::server::store_schema
