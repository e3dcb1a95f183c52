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

/// What the first bytes of a file say: nothing against it, or why it is no store of ours. A file that is not
/// there or empty is none's.
std::optional<hal::Error> check_header(const std::string& path);

/// The same of an open database, with what its journal holds. Throws SQLite::Exception.
std::optional<hal::Error> check(SQLite::Database& database, const std::string& path);

/// Brings an open database to kVersion, all steps or none. Another process may do the same at once. Throws
/// SQLite::Exception.
std::optional<hal::Error> migrate(SQLite::Database& database, const std::string& path);

}  // namespace hapticd::server::store_schema
