// Boost.Asio and Boost.Beast, compiled once for the whole program (see BOOST_ASIO_SEPARATE_COMPILATION).
#include <boost/asio/impl/src.hpp>
#include <boost/asio/ssl/impl/src.hpp>
#include <boost/beast/src.hpp>
#include <utility>  // before Boost.Asio 1.74, which forgets it
