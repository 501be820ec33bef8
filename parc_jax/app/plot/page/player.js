// A play button and a slider over moments 0 to last, so many seconds apart: show(t).

function makePlayer(button, slider, last, seconds, show) {
  let playing = 0;
  const go = (t) => { slider.value = t; show(t); };
  const stop = () => { clearInterval(playing); playing = 0; button.textContent = "▶"; };
  slider.max = last;
  slider.oninput = () => show(Number(slider.value));
  button.onclick = () => {
    if (playing) { stop(); return; }
    if (Number(slider.value) >= last) go(0);
    button.textContent = "❚❚";
    playing = setInterval(() => { if (Number(slider.value) >= last) stop(); else go(Number(slider.value) + 1); }, 1000 * seconds);
  };
  return go;
}

// a time [s], whole: to two digits, or as many as it has
function spelled(time) {
  const exact = Number(time.toFixed(9)), short = exact.toFixed(2);
  return Number(short) === exact ? short : String(exact);
}
