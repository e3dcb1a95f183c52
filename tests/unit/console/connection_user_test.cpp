#include "client/console/access/connection_user.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>

namespace hapticd::console {
namespace {

using boost::asio::ip::make_address;
using Tcp = boost::asio::ip::tcp;

TEST(ConnectionUser, IsThatOfTheKernel) {
  for (const char* host : {"127.0.0.1", "::1"}) {
    boost::asio::io_context context;
    Tcp::acceptor acceptor(context, {make_address(host), 0});
    Tcp::socket there(context);
    there.connect(acceptor.local_endpoint());
    const Tcp::socket here = acceptor.accept();
    const Tcp::endpoint own = here.local_endpoint();
    EXPECT_EQ(user_of_connection(here.remote_endpoint(), own), geteuid()) << host;
    const Tcp::endpoint another(own.address(), static_cast<std::uint16_t>(own.port() ^ 1U));
    EXPECT_EQ(user_of_connection(here.remote_endpoint(), another), std::nullopt) << host;
    there.close();
    EXPECT_EQ(user_of_connection(here.remote_endpoint(), own), std::nullopt) << "closed by its owner";
  }
}

}  // namespace
}  // namespace hapticd::console
