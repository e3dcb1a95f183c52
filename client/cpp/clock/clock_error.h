#pragma once

#include <string>

#include "client/cpp/error.h"

namespace hapticd::client {

/// An Error of kind kBadClock.
inline Error clock_error(const std::string& what, const std::string& where, const std::string& value,
                         const std::string& limit, const std::string& remedy) {
  v1::ErrorDetail detail;
  detail.set_what(what);
  detail.set_where(where);
  detail.set_value(value);
  detail.set_limit(limit);
  detail.set_remedy(remedy);
  return {ErrorKind::kBadClock, "", detail};
}

}  // namespace hapticd::client
