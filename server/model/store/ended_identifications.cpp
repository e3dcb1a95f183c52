#include <algorithm>

#include "server/model/store/model_store_state.h"

namespace hapticd::server {

namespace {

constexpr const char* kIdentificationsKept = "1000";

}  // namespace

Outcome<std::uint64_t> ModelStore::record_identification(const EndedIdentification& ended, Until until) {
  return state_->guarded(until, [&]() -> Outcome<std::uint64_t> {
    SQLite::Transaction transaction(state_->database, SQLite::TransactionBehavior::IMMEDIATE);
    SQLite::Statement row(state_->database,
                          "INSERT INTO identifications "
                          "(id, kind, object, state, ended_at, model, problem, progress) "
                          "VALUES (?, ?, ?, ?, ?, ?, ?, x'')");  // no longer used
    row.bind(1, ended.id);
    row.bind(2, ended.kind);
    row.bind(3, ended.object);
    row.bind(4, ended.state);
    row.bind(5, ended.ended_at_unix_s);
    row.bind(6, ended.model_hash);
    row.bind(7, ended.problem);
    row.exec();
    const auto sequence = static_cast<std::uint64_t>(state_->database.getLastInsertRowid());
    state_->database.exec(std::string("DELETE FROM identifications WHERE sequence <= "
                                      "(SELECT max(sequence) FROM identifications) - ") +
                          kIdentificationsKept);
    if (auto refusal = state_->commit(transaction)) return *refusal;
    return sequence;
  });
}

Outcome<std::vector<EndedIdentification>> ModelStore::list_identifications(std::size_t limit,
                                                                           Until until) const {
  return state_->guarded(until, [&]() -> Outcome<std::vector<EndedIdentification>> {
    SQLite::Statement query(state_->database,
                            "SELECT id, kind, object, state, ended_at, model, problem "
                            "FROM identifications ORDER BY sequence DESC LIMIT ?");
    query.bind(1, static_cast<std::int64_t>(std::min<std::size_t>(limit, 1'000'000)));
    std::vector<EndedIdentification> all;
    while (query.executeStep()) {
      EndedIdentification& ended = all.emplace_back();
      ended.id = query.getColumn(0).getString();
      ended.kind = query.getColumn(1).getString();
      ended.object = query.getColumn(2).getString();
      ended.state = query.getColumn(3).getString();
      ended.ended_at_unix_s = query.getColumn(4).getInt64();
      ended.model_hash = query.getColumn(5).getString();
      ended.problem = query.getColumn(6).getString();
    }
    return all;
  });
}

}  // namespace hapticd::server
