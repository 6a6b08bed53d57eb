// Unpacks the data and the drawing library of the page, gzip as base64, and then runs what draws them.
"use strict";
(async () => {
  const unpack = async (place) => {
    const stream = new DecompressionStream("gzip"), writer = stream.writable.getWriter();
    writer.write(Uint8Array.from(atob(place.textContent), (one) => one.charCodeAt(0)));
    writer.close();
    return new Response(stream.readable).text();
  };
  const run = (text) => {
    const script = document.createElement("script");
    script.textContent = text;
    document.body.append(script);
  };
  if (typeof DecompressionStream === "undefined") {
    document.getElementById("old").hidden = false;
    return;
  }
  const [library, data] = ["library", "data"].map((name) => document.getElementById(name));
  run(await unpack(library));
  data.textContent = await unpack(data);
  for (const one of document.querySelectorAll("script.own")) run(one.textContent);
  library.remove();
  document.dispatchEvent(new Event("unpacked"));
})();
