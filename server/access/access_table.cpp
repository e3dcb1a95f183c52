#include "server/access/access_table.h"

#include <algorithm>

namespace hapticd::server {

const AccessRow* find_access_row(std::string_view method) {
  const auto* found = std::find_if(kAccessTable.begin(), kAccessTable.end(),
                                   [&](const AccessRow& row) { return row.method == method; });
  return found == kAccessTable.end() ? nullptr : found;
}

}  // namespace hapticd::server
