#include "server/access/access_table.h"

#include <algorithm>

#include "server/access/role_policy.h"

namespace hapticd::server {

const AccessRow* find_access_row(std::string_view method) {
  const auto* found = std::find_if(kAccessTable.begin(), kAccessTable.end(),
                                   [&](const AccessRow& row) { return row.method == method; });
  return found == kAccessTable.end() ? nullptr : found;
}

std::string access_table_markdown() {
  std::string text = "| call | role | lease | audit |\n|---|---|---|---|\n";
  for (const AccessRow& row : kAccessTable) {
    const std::string role = row.role == Role::kNone ? "any identity" : std::string(to_text(row.role));
    text += "| `" + std::string(row.method) + "` | " + role + " | " + (row.needs_lease ? "yes" : "no") +
            " | " + (row.is_audited ? "always" : "where refused") + " |\n";
  }
  return text;
}

}  // namespace hapticd::server
