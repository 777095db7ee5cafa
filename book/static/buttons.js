// The addresses on the page of the notebooks have OWNER/NAME in them: whoever says theirs gets buttons.
const REPOSITORY = document.currentScript.dataset.repository || published();

function published() {  // a book at owner.github.io/name tells where it is from
  const owner = location.hostname.match(/^([\w-]+)\.github\.io$/);
  const name = location.pathname.split("/")[1];
  return owner && name ? `${owner[1]}/${name}` : "";
}

function nameOf(text) {  // owner/name, of that or of an address
  const found = text.trim().match(/^(?:https?:\/\/)?(?:github\.com\/)?([\w.-]+\/[\w.-]+?)(?:\.git)?\/?$/);
  return found ? found[1] : "";
}

document.addEventListener("DOMContentLoaded", () => {
  const place = document.getElementById("buttons");
  if (!place) return;
  const lines = [...document.querySelectorAll("pre")].flatMap((each) => each.textContent.split("\n"));
  const addresses = lines.filter((line) => /^https:\S+OWNER\/NAME\S*$/.test(line));
  const field = document.createElement("input");
  field.value = REPOSITORY;
  field.placeholder = "owner/name on GitHub";
  const label = document.createElement("label");
  label.append("The copy on GitHub: ", field);
  place.append(label);
  for (const address of addresses) {
    const button = document.createElement("a");
    button.className = "button";
    button.textContent = address.includes("binder") ? "Binder" : "Colab";
    const follow = () => {
      const name = nameOf(field.value);
      if (name) button.href = address.replace("OWNER/NAME", name);
      else button.removeAttribute("href");
    };
    field.addEventListener("input", follow);
    follow();
    place.append(button);
  }
});
