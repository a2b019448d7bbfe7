// Unpacks the script of the page, and runs it. Its hash is in the policy of the page: no other one runs.

async function unpack() {
  const packed = Uint8Array.from(atob(document.getElementById("packed").textContent), (one) => one.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  document.head.append(Object.assign(document.createElement("script"), { textContent: await new Response(stream).text() }));
}

unpack().catch((error) => {
  const [title, text] = document.getElementById("says").children;
  document.getElementById("line").dataset.level = "fault";
  title.textContent = "This browser cannot run the page.";
  text.textContent = `It is too old: Chrome 97, Edge 97, Firefox 113, Safari 16.4 or newer can (${error.message}).`;
});
