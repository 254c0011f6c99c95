# Two robots behind one Varnish, which caches what they state an age for. TLS ends before it (HAProxy, nginx). Tried with Varnish 7.1.
#
#   on cell7: baxter --public-base https://robots.example/cell7
#   on cell8: baxter --public-base https://robots.example/cell8
#
#   varnishd -f /etc/varnish/robots.vcl -a 127.0.0.1:6081 -s malloc,256m

vcl 4.1;

backend cell7 { .host = "127.0.0.1"; .port = "8080"; }
backend cell8 { .host = "127.0.0.1"; .port = "8081"; }

sub vcl_recv {
  if (req.url ~ "^/cell7(/|$)") {
    set req.backend_hint = cell7;
  } elsif (req.url ~ "^/cell8(/|$)") {
    set req.backend_hint = cell8;
  } else {
    return (synth(404));
  }
  # A WebSocket or an event stream is a connection to the robot.
  if (req.http.Upgrade || req.http.Accept ~ "(?i)text/event-stream") {
    return (pipe);
  }
  # The rest is Varnish's own: requests with Authorization or Cookie, and other methods than GET and HEAD, are not answered from the cache.
}

sub vcl_pipe {
  if (req.http.Upgrade) {
    set bereq.http.Upgrade = req.http.Upgrade;
    set bereq.http.Connection = "Upgrade";
  } else {
    set bereq.http.Connection = "close";
  }
}

sub vcl_backend_response {
  # Only as long as the robot says may an old value be served (max-age, stale-while-revalidate). Then it is kept so that the robot is asked with
  # If-None-Match, once for all who wait.
  if (beresp.http.Cache-Control !~ "stale-while-revalidate") {
    set beresp.grace = 0s;
  }
  set beresp.keep = 1h;
}

sub vcl_deliver {
  # For people who look.
  if (obj.hits > 0) {
    set resp.http.X-Cache = "HIT";
  } else {
    set resp.http.X-Cache = "MISS";
  }
}
