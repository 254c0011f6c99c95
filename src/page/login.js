// SPDX-License-Identifier: Apache-2.0
// The login form of a 401 response. The token is sent in a header field; afterwards a cookie replaces it. No URL contains the token.

const form = document.querySelector("form"), token = form.querySelector("input"), trouble = form.querySelector("[role=alert]");
const path = new URL(form.dataset.session).pathname;  // at the origin of this page, whatever the public base is

/// Opens the requested page: this address, or at the address of the session the path in the fragment.
function openRequestedPage() {
  if (location.pathname !== path) return location.reload();
  const root = new URL("..", location.origin + path), wanted = new URL(location.hash.slice(1), root);
  location.replace(wanted.origin === location.origin && wanted.pathname !== path ? wanted : root);
}

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  trouble.textContent = "";
  const text = token.value.trim();
  try {
    const response = /^[!-~]+$/.test(text) ? await fetch(path, { method: "POST", headers: { Authorization: `Bearer ${text}` } }) : { status: 401 };
    if (response.ok) return openRequestedPage();
    trouble.textContent = response.status === 401 ? "This token is not valid." : (await response.json()).detail;
  } catch {
    trouble.textContent = "The robot does not respond.";
  }
  token.select();
});
