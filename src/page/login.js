// The form of a 401: the token goes to the robot in a header field, so that no address and no other page has it, and a cookie stands for it then.

const form = document.querySelector("form"), token = form.querySelector("input"), trouble = form.querySelector("[role=alert]");
const path = new URL(form.dataset.session).pathname;  // here, whatever the public base is

/// The page that was asked for: this one, or at the address of the session the one in the fragment.
function arrive() {
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
    if (response.ok) return arrive();
    trouble.textContent = response.status === 401 ? "This token is not valid." : (await response.json()).detail;
  } catch {
    trouble.textContent = "The robot does not respond.";
  }
  token.select();
});
